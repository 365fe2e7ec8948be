"""A coarse arch on a fine slab and a fine arch on a coarse slab: two places of contact each.

The paper's Fig. 1. Contact is sampled at the vertices of both bodies, and one pair of bodies may
touch in several places at once. Look at the feet: both stand on the slab, whichever of the two
bodies has the fine mesh, and the two sides of the picture settle alike.
"""

import numpy as np

from warp_contact.scene.materials import NeoHookean
from warp_contact.scene.mesh import TetMesh
from warp_contact.scene.scene import Scene
from warp_contact.scene.shapes import box

RADIUS = 0.1  # of the arch's middle line [m]
WIDTH = 0.05  # of the arch's square section [m]
SLAB = (0.32, 0.08, 0.04)  # [m]
COARSE, FINE = 2, 5  # cells across the arch
YOUNG = 1e5  # [Pa]
POISSON = 0.3  # [-]
DENSITY = 1000.0  # [kg/m^3]
DAMPING = 1e-3  # [s]
GAP = 0.01  # the arches fall by this [m]
SPACING = 0.4  # between the slabs [m]

FRAMES = 120
VIEW = {"eye": (0.0, -0.95, 0.35), "target": (0.0, 0.0, 0.075)}
PENALTY = {"stiffness": 2000.0, "damping": 1.0}  # [N/m], [N s/m]


def build(
    coarse: int = COARSE,
    fine: int = FINE,
    young: float = YOUNG,
    friction: float = 0.5,
    damping: float = DAMPING,
) -> Scene:
    """The slabs lie on the floor, the arches start ``GAP`` above them."""
    scene = Scene(friction=friction)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    rubber = NeoHookean(young, POISSON, DENSITY, damping)
    for name, x, above, below in (
        ("coarse_on_fine", -0.5 * SPACING, coarse, fine),
        ("fine_on_coarse", 0.5 * SPACING, fine, coarse),
    ):
        scene.add_body(slab(below), rubber, (x, 0.0, 0.5 * SLAB[2]), label=f"{name}_slab")
        scene.add_body(arch(above), rubber, (x, 0.0, SLAB[2] + GAP), label=f"{name}_arch")
    return scene


def slab(cells: int) -> TetMesh:
    """A slab with ``cells`` to the width of an arch."""
    return box(SLAB, [max(1, round(s * cells / WIDTH)) for s in SLAB])


def arch(cells: int) -> TetMesh:
    """A bar bent into half a circle, its feet at z = 0; ``cells`` across."""
    bar = box((np.pi * RADIUS, WIDTH, WIDTH), (round(np.pi * RADIUS * cells / WIDTH), cells, cells))
    x, y, z = bar.vertices.T
    r = RADIUS + z
    return TetMesh(np.stack([r * np.sin(x / RADIUS), y, r * np.cos(x / RADIUS)], axis=1), bar.tets)
