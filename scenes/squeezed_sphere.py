"""Two stiff cubes squeeze a soft, coarse sphere; their stiffness is 100 times its own.

The paper's Fig. 8, with its 95 vertices and 166 surface triangles, of which no more than 17
vertices touch. Look at the flattened poles of the sphere: its surface follows the cubes, and the
cubes keep their shape. The top of the upper cube comes down at a given speed.
"""

from warp_contact.scene.materials import NeoHookean
from warp_contact.scene.scene import Scene, rotation_matrix
from warp_contact.scene.shapes import box, sphere

RADIUS = 0.06  # of the sphere [m]
EDGE = 0.1  # of a cube [m]
YOUNG = 2e4  # of the sphere [Pa]
RATIO = 100.0  # stiffness of the cubes over that of the sphere
POISSON = 0.4  # of the sphere [-]
DENSITY = 1000.0  # [kg/m^3]
DAMPING = 1e-3  # [s]
SPEED = 0.02  # of the upper cube, downwards [m/s]
GAP = 0.001  # at both poles of the sphere [m]
TURN = (-0.942545, 0.313881, 0.0, 0.1144)  # puts the sphere on a triangle, not on a vertex

FRAMES = 120
VIEW = {"eye": (0.25, -0.85, 0.32), "target": (0.0, 0.0, 0.155)}
PENALTY = {"stiffness": 1000.0, "damping": 0.5}  # [N/m], [N s/m]: E radius of the sphere


def build(
    young: float = YOUNG,
    ratio: float = RATIO,
    speed: float = SPEED,
    friction: float = 0.5,
    damping: float = DAMPING,
) -> Scene:
    """The lower cube stands on z = 0 and is held there, the upper one is held at its top."""
    scene = Scene(friction=friction)
    cube = box(EDGE, 2)
    ball = sphere(RADIUS, 41).transformed(rotation_matrix(TURN))
    stiff = NeoHookean(ratio * young, 0.3, DENSITY, damping)
    soft = NeoHookean(young, POISSON, DENSITY, damping)
    low, high = ball.vertices[:, 2].min(), ball.vertices[:, 2].max()
    centre = EDGE + GAP - low
    bottom, top = cube.vertices[:, 2] < -0.499 * EDGE, cube.vertices[:, 2] > 0.499 * EDGE
    scene.add_body(cube, stiff, (0.0, 0.0, 0.5 * EDGE), fixed=bottom, label="lower_cube")
    scene.add_body(ball, soft, (0.0, 0.0, centre), label="sphere")
    scene.add_body(
        cube,
        stiff,
        (0.0, 0.0, centre + high + GAP + 0.5 * EDGE),
        velocity=(0.0, 0.0, -speed),
        fixed=top,
        label="upper_cube",
    )
    return scene
