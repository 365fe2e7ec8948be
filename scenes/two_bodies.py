"""Two pairs of blocks start inside each other, one pair of equal and one of unequal stiffness.

The paper's Fig. 6. The outer ends are held, so the pressure between the blocks stays. Look at where
the contact surface comes to lie: half-way for equal blocks, and close to the undeformed surface of
the stiff block for unequal ones. No velocity may appear from resolving the overlap.

For a Poisson's ratio of 0 they are two springs in series: p = g / (L/E1 + L/E2), see ``pressure``.
"""

import numpy as np

from warp_contact.scene.materials import NeoHookean
from warp_contact.scene.mesh import TetMesh
from warp_contact.scene.scene import Scene
from warp_contact.scene.shapes import box

EDGE = 0.1  # of a block [m]
YOUNG = 5e4  # of the soft blocks [Pa]
POISSON = 0.3  # [-]
DENSITY = 1000.0  # [kg/m^3]
DAMPING = 1e-3  # [s]
SPACING = 0.25  # between the pairs [m]

FRAMES = 120
VIEW = {"eye": (0.0, -0.6, 0.2), "target": (0.0, 0.0, 0.1)}
PENALTY = {"stiffness": 1000.0, "damping": 1.0}  # [N/m], [N s/m]: E edge of an element


def build(
    ratio: float = 10.0,
    overlap: float = 0.1,
    cells: int = 4,
    cells_upper: int | None = None,
    young: float = YOUNG,
    poisson: float = POISSON,
    damping: float = DAMPING,
) -> Scene:
    """Equal blocks at the left, 1 : ``ratio`` at the right; ``overlap`` in parts of a block."""
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    lower = box(EDGE, cells)
    upper = box(EDGE, cells_upper or cells, mirrored=cells % 2 == 1)  # equal cells: equal diagonals
    for name, x, factor in (("equal", -0.5 * SPACING, 1.0), ("unequal", 0.5 * SPACING, ratio)):
        soft = NeoHookean(young, poisson, DENSITY, damping)
        stiff = NeoHookean(factor * young, poisson, DENSITY, damping)
        low, high = (x, 0.0, 0.5 * EDGE), (x, 0.0, (1.5 - overlap) * EDGE)
        scene.add_body(lower, soft, low, fixed=end(lower, -1.0), label=f"{name}_lower")
        scene.add_body(upper, stiff, high, fixed=end(upper, 1.0), label=f"{name}_upper")
    return scene


def end(mesh: TetMesh, side: float) -> np.ndarray:
    """Mask of the vertices at the lower (-1) or upper (1) end."""
    return side * mesh.vertices[:, 2] > 0.5 * EDGE - 1e-6


def pressure(ratio: float, overlap: float = 0.1, young: float = YOUNG) -> float:
    """Pressure between the blocks [Pa], for small strain and a Poisson's ratio of 0."""
    return overlap * young / (1.0 + 1.0 / ratio)
