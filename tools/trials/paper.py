"""Where the paper's scenes lie in the maps, one mark for each pair of bodies that says something.

    step    their step scaled by l / c to that of the map's blocks, l the shortest edge of the body
            with the largest c / l, c the square root of its Young's modulus over its density;
            against that modulus
    ratio   masses over the areas seen from above, all that lies on the lower body together;
            against Young's moduli, upper over lower
    depth   overlap at the start and thickness of the lower body, of the upper body's middle extent
    speed   that of the first impact, and their step scaled by the thickness of the lower body

The step is that of their first frame at 60 frames per second. Of the bowl a tenth is built.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

import warp_contact as wc
from trials.case import G
from trials.watch import young
from warp_contact import scenes

FPS = 60


@dataclass(frozen=True)
class Pair:
    """Two bodies of a scene, by label.

    Attributes:
        upper, lower: the bodies
        above: bodies like the upper one on the lower
        fall: height that the upper body falls to the first impact [m]
        speed: of the upper body where it is driven [m/s]
        overlap: at the start [m]
    """

    upper: str
    lower: str
    above: int = 1
    fall: float = 0.0
    speed: float = 0.0
    overlap: float = 0.0


@dataclass(frozen=True)
class Start:
    """A scene as the maps see it: its bodies by label and the step of its first frame [s]."""

    bodies: dict[str, object]
    step: float


ARCHES = (Pair("coarse_on_fine_arch", "coarse_on_fine_slab", fall=0.01),)
BLOCKS = tuple(Pair(f"{k}_upper", f"{k}_lower", overlap=0.01) for k in ("equal", "unequal"))
CUBES = tuple(Pair(f"cube_{mass}", "membrane", fall=0.005) for mass in (1, 4, 16))
SQUEEZED = (Pair("upper_cube", "sphere", speed=0.02),)
FRUITS = (Pair("melon_1", "lemon_1", fall=0.9),)
SHEETS = (Pair("membrane_1", "membrane_0", above=8, fall=0.09),)
FIGURES = {  # the paper's figure, arguments of build(), pairs
    "sampling": (1, {}, ARCHES),
    "two_bodies": (6, {}, BLOCKS),
    "cubes_on_membrane": (7, {}, CUBES),
    "squeezed_sphere": (8, {}, SQUEEZED),
    "bowl": (9, {"fraction": 0.1}, FRUITS),
    "membrane_stack": (10, {}, SHEETS),
}


@cache
def started(name: str) -> Start:
    """Build a scene and step one frame."""
    scene = scenes.load(name).build(**FIGURES[name][1])
    sim = wc.Simulation(scene, fps=FPS)
    sim.step_frame()
    return Start({body.label: body for body in scene.bodies}, 1.0 / (FPS * sim.substeps))


def extents(body) -> np.ndarray:
    """Width, depth and height of a body at its start [m]."""
    return np.ptp(body.x, axis=0)


def rate(body) -> float:
    """Speed of sound over the shortest edge [1/s]."""
    p, q = body.mesh.edges.T
    edge = np.linalg.norm(body.mesh.vertices[p] - body.mesh.vertices[q], axis=1).min()
    return float(np.sqrt(young(body) / body.material.density) / edge)


def load(body) -> float:
    """Mass over the area seen from above [kg/m^2]."""
    return body.material.density * body.mesh.volume / float(np.prod(extents(body)[:2]))


def step_stiffness(start: Start, pair: Pair, cell: wc.Scene) -> tuple[float, float]:
    """Step [s] and Young's modulus [Pa]."""
    ruling = max(start.bodies.values(), key=rate)
    block = max(cell.bodies, key=rate)
    alike = rate(block) * np.sqrt(young(ruling) / young(block))
    return start.step * rate(ruling) / alike, young(ruling)


def mass_stiffness(start: Start, pair: Pair, cell: wc.Scene) -> tuple[float, float]:
    """Ratios of mass and stiffness, upper over lower."""
    upper, lower = start.bodies[pair.upper], start.bodies[pair.lower]
    return pair.above * load(upper) / load(lower), young(upper) / young(lower)


def overlap_thickness(start: Start, pair: Pair, cell: wc.Scene) -> tuple[float, float]:
    """Overlap and thickness, of the upper body's middle extent."""
    edge = np.sort(extents(start.bodies[pair.upper]))[1]
    return pair.overlap / edge, extents(start.bodies[pair.lower])[2] / edge


def speed_step(start: Start, pair: Pair, cell: wc.Scene) -> tuple[float, float]:
    """Speed [m/s] and step [s]."""
    speed = pair.speed or float(np.sqrt(2.0 * G * pair.fall))
    scale = extents(cell.bodies[0])[2] / extents(start.bodies[pair.lower])[2]
    return speed, start.step * scale


PLACES = {
    "step": step_stiffness,
    "ratio": mass_stiffness,
    "depth": overlap_thickness,
    "speed": speed_step,
}


def marks(sweep: str, cell: wc.Scene) -> list[tuple[int, float, float]]:
    """Figure, x and y of the scenes in a sweep; ``cell`` is the scene of any of its cells."""
    found = []
    for name, (figure, _, pairs) in FIGURES.items():
        places = {PLACES[sweep](started(name), pair, cell) for pair in pairs}
        found += [(figure, *map(float, place)) for place in sorted(places)]
    return found
