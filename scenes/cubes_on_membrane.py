"""Three cubes of masses 1 : 4 : 16 on a membrane that is held at its rim.

The paper's Fig. 7, with its 323 vertices and 624 surface triangles. Look at the heavy cube: it sags
with the membrane but does not sink into it. With penalty forces it sinks in by W / (n k), for a
weight W on n vertices of stiffness k. A stiffness that holds it is too high for the light cube.
"""

import numpy as np

from warp_contact.scene.materials import NeoHookean
from warp_contact.scene.mesh import TetMesh
from warp_contact.scene.scene import Scene
from warp_contact.scene.shapes import box

MEMBRANE = (0.6, 0.6, 0.015)  # [m]
EDGE = 0.1  # of a cube [m]
SPACING = 0.18  # between the cubes [m]
DENSITY = 250.0  # of the lightest cube [kg/m^3]: 0.25 kg
MASSES = (1.0, 4.0, 16.0)  # relative to it
CUBE_YOUNG, MEMBRANE_YOUNG = 2e5, 1e6  # [Pa]
POISSON = 0.3  # [-]
DAMPING = 1e-3  # [s]
GAP = 0.005  # the cubes fall by this [m]

FRAMES = 120
VIEW = {"eye": (0.12, -1.05, 0.3), "target": (0.0, 0.0, 0.02)}
PENALTY = {"stiffness": 2000.0, "damping": 1.0}  # [N/m], [N s/m]


def build(
    membrane_young: float = MEMBRANE_YOUNG,
    cube_young: float = CUBE_YOUNG,
    density: float = DENSITY,
    friction: float = 0.5,
    damping: float = DAMPING,
) -> Scene:
    """The membrane's upper side is at z = 0; the cubes stand in a row, the lightest at the left."""
    scene = Scene(friction=friction)
    sheet = box(MEMBRANE, (10, 10, 1))
    skin = NeoHookean(membrane_young, POISSON, 1000.0, damping)
    scene.add_body(sheet, skin, (0, 0, -0.5 * MEMBRANE[2]), fixed=rim(sheet), label="membrane")
    cube = box(EDGE, 2)
    for k, mass in enumerate(MASSES):
        material = NeoHookean(cube_young, POISSON, mass * density, damping)
        place = ((k - 1) * SPACING, 0.0, 0.5 * EDGE + GAP)
        scene.add_body(cube, material, place, label=f"cube_{mass:g}")
    return scene


def rim(sheet: TetMesh) -> np.ndarray:
    """Mask of the vertices at the four sides of the membrane."""
    return np.abs(sheet.vertices[:, :2]).max(axis=1) > 0.5 * MEMBRANE[0] - 1e-6
