"""Nine membranes fall onto each other on a floor.

The paper's Fig. 10, with its 2178 vertices and 4320 surface triangles. Look at kinetic and
potential energy over time: the stack comes to rest and stays as high as its own weight allows. With
penalty forces it is compressed further and moves for longer.
"""

from warp_contact.scene.materials import NeoHookean
from warp_contact.scene.scene import Scene
from warp_contact.scene.shapes import box

COUNT = 9
WIDTH, THICKNESS = 0.4, 0.01  # [m]
GAP = 0.01  # below each membrane [m]
YOUNG = 5e4  # [Pa]
POISSON = 0.3  # [-]
DENSITY = 1000.0  # [kg/m^3]
DAMPING = 1e-3  # [s]

FRAMES = 120
VIEW = {"eye": (0.45, -0.9, 0.36), "target": (0.0, 0.0, 0.045)}
PENALTY = {"stiffness": 200.0, "damping": 0.2}  # [N/m], [N s/m]


def build(
    count: int = COUNT,
    gap: float = GAP,
    young: float = YOUNG,
    friction: float = 0.3,
    damping: float = DAMPING,
) -> Scene:
    """The floor is z = 0; the membranes lie exactly above each other."""
    scene = Scene(friction=friction)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    rubber = NeoHookean(young, POISSON, DENSITY, damping)
    sheet = box((WIDTH, WIDTH, THICKNESS), (10, 10, 1))
    for k in range(count):
        height = 0.5 * THICKNESS + gap + k * (THICKNESS + gap)
        scene.add_body(sheet, rubber, (0.0, 0.0, height), label=f"membrane_{k}")
    return scene
