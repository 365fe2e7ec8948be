"""What is drawn on a map: its frontier, and where the paper's scenes lie.

These have a mark for each pair of bodies that says something:

    step    their step scaled by l / c to that of the map's blocks, l the shortest edge of the body
            with the largest c / l, c the square root of its Young's modulus over its density;
            against that modulus
    ratio   masses over the areas seen from above, all that lies on the lower body together;
            against Young's moduli, upper over lower
    depth   overlap at the start and thickness of the lower body, of the upper body's middle extent
    speed   that of the first impact, and their step scaled by the thickness of the lower body

The step is that of their first frame at 60 frames per second. Of the bowl a tenth is built.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

import warp_contact as wc
from trials.outcome import FINE
from trials.setting import G
from trials.sweeps import Sweep
from warp_contact import scenes

FPS = 60
CLOSE = 0.04  # of a map: marks that are nearer share one


class Pair(NamedTuple):
    """Two bodies of a scene, by label."""

    upper: str
    lower: str
    above: int = 1  # bodies like the upper one on the lower
    fall: float = 0.0  # of the upper body to the first impact [m]
    speed: float = 0.0  # of the upper body where it is driven [m/s]
    overlap: float = 0.0  # at the start [m]


BLOCKS = [Pair(f"{k}_upper", f"{k}_lower", overlap=0.01) for k in ("equal", "unequal")]
FIGURES = {  # the paper's figure, arguments of build(), pairs
    "sampling": (1, {}, [Pair("coarse_on_fine_arch", "coarse_on_fine_slab", fall=0.01)]),
    "two_bodies": (6, {}, BLOCKS),
    "cubes_on_membrane": (7, {}, [Pair(f"cube_{m}", "membrane", fall=0.005) for m in (1, 4, 16)]),
    "squeezed_sphere": (8, {}, [Pair("upper_cube", "sphere", speed=0.02)]),
    "bowl": (9, {"fraction": 0.1}, [Pair("melon_1", "lemon_1", fall=0.9)]),
    "membrane_stack": (10, {}, [Pair("membrane_1", "membrane_0", above=8, fall=0.09)]),
}


@cache
def started(name: str) -> tuple[dict, float]:
    """The bodies of a scene by label and the step of its first frame [s]."""
    scene = scenes.load(name).build(**FIGURES[name][1])
    sim = wc.Simulation(scene, fps=FPS)
    sim.step_frame()
    return {body.label: body for body in scene.bodies}, 1.0 / (FPS * sim.substeps)


def rate(body) -> float:
    """Speed of sound over the shortest edge [1/s]."""
    p, q = body.mesh.edges.T
    edge = np.linalg.norm(body.mesh.vertices[p] - body.mesh.vertices[q], axis=1).min()
    return float(np.sqrt(young(body) / body.material.density) / edge)


def young(body) -> float:
    """Young's modulus [Pa]."""
    return body.material.youngs_modulus


def extents(body) -> np.ndarray:
    """Width, depth and height at the start [m]."""
    return np.ptp(body.x, axis=0)


def load(body) -> float:
    """Mass over the area seen from above [kg/m^2]."""
    return body.material.density * body.mesh.volume / float(np.prod(extents(body)[:2]))


def mark(sweep: str, bodies: dict, step: float, pair: Pair, cell: wc.Scene) -> tuple[float, float]:
    """Place of a pair in a sweep, x and y as the sweep has them; ``cell`` is any of its scenes."""
    upper, lower = bodies[pair.upper], bodies[pair.lower]
    if sweep == "step":
        ruling, block = max(bodies.values(), key=rate), max(cell.bodies, key=rate)
        alike = rate(block) * np.sqrt(young(ruling) / young(block))
        return step * rate(ruling) / alike, young(ruling)
    if sweep == "ratio":
        return pair.above * load(upper) / load(lower), young(upper) / young(lower)
    if sweep == "depth":
        edge = np.sort(extents(upper))[1]
        return pair.overlap / edge, extents(lower)[2] / edge
    speed = pair.speed or float(np.sqrt(2.0 * G * pair.fall))
    return speed, step * extents(cell.bodies[0])[2] / extents(lower)[2]


def marks(sweep: str, cell: wc.Scene) -> list[tuple[int, float, float]]:
    """Figure, x and y of the scenes in a sweep."""
    found = []
    for name, (figure, _, pairs) in FIGURES.items():
        places = {mark(sweep, *started(name), pair, cell) for pair in pairs}
        found += [(figure, *map(float, place)) for place in sorted(places)]
    return found


def limit_line(s: Sweep, xs: np.ndarray, ys: np.ndarray) -> tuple[list[float], list[float]]:
    """The line of the sweep's limit, as far as it lies on the map."""
    places = [(float(i), place(y, ys)) for i, y in enumerate(s.limit[1](xs).tolist())]
    on = [(i, j) for i, (j, off) in places if not off]
    return [i for i, _ in on], [j for _, j in on]


def labels(scenes: list[tuple], xs: np.ndarray, ys: np.ndarray) -> dict:
    """Text and colour of the marks by their place; scenes in one place share a mark."""
    found: dict[tuple, list] = {}
    for figure, x, y in scenes:
        (i, aside), (j, above) = place(x, xs), place(y, ys)
        near = (at for at in found if np.hypot(at[0] - i, at[1] - j) < CLOSE * len(xs))
        mark = found.setdefault(next(near, (i, j)), [])
        mark.append((str(figure), "lightgrey" if aside or above else "white"))
    return {at: (", ".join(dict.fromkeys(f for f, _ in m)), m[-1][1]) for at, m in found.items()}


def place(value: float, values: np.ndarray) -> tuple[float, bool]:
    """Where a value lies between the cells, and whether it is off the map, then on its rim."""
    last = len(values) - 1
    with np.errstate(divide="ignore"):
        at = last * float(np.log(value / values[0]) / np.log(values[-1] / values[0]))
    return float(np.clip(at, -0.5, last + 0.5)), not -0.5 <= at <= last + 0.5


def frontier(grid: list[list[str]]) -> list[tuple[tuple, tuple]]:
    """The sides between a cell that is fine and one that is not: (x, x), (y, y) of their ends."""
    fine = np.array(grid) == FINE
    right = np.argwhere(fine[:, 1:] != fine[:, :-1]).tolist()
    above = np.argwhere(fine[1:] != fine[:-1]).tolist()
    sides = [((i + 0.5, i + 0.5), (j - 0.5, j + 0.5)) for j, i in right]
    return sides + [((i - 0.5, i + 0.5), (j + 0.5, j + 0.5)) for j, i in above]
