"""Panels with scenes of the paper: distances of surfaces, and from a converged run.

Surfaces that press on each other ought to be at distance zero, so an overlap is an error and a gap
is one too: a method that keeps bodies apart by a margin has no overlap, and a gap that can be seen.

The motion has no closed form. It is compared with that of the default at ``CONVERGED`` times the
steps, which half as many change by 1e-4 to 2e-4 of an edge. The reference is our own, so for our
methods the figure tells how consistent they are. Others confirm it: the stiffest penalty and the
predicted forces come within 0.3 to 1.2 % of an edge of it.
"""

from functools import cache, lru_cache

import numpy as np
from engines import ours
from engines.task import Failed, Motion, Task
from verification.scenes import in_edges
from verification.setup import mean_edge

import warp_contact as wc
from chart.distance import distance
from chart.panel import Panel, late, sound
from warp_contact import scenes

FPS = 60
FRAMES = 60
CONVERGED = 16  # times the steps
LATE = 0.25  # part of the frames at the end in which the bodies of a pair touch
TUNNELLED = 1.0  # of an edge: an overlap or gap from which a body is on the wrong side
TITLES = {"squeezed_sphere": "squeezed sphere", "cubes_on_membrane": "cubes on a membrane 1:4:16"}
# Bodies that are squeezed together, or rest on each other, by their labels.
PRESSED = [("lower_cube", "sphere"), ("sphere", "upper_cube")]
PRESSED += [("membrane", f"cube_{mass}") for mass in (1, 4, 16)]


def scene(name: str) -> tuple[Task, list[Panel]]:
    """A scene of the paper: overlap and gap, its overlap alone, its motion."""
    module, title = scenes.load(name), TITLES[name] + "\n{} [of an edge]"
    return Task(module.build, FPS, FRAMES, **module.PENALTY), [
        Panel(name, title.format("overlap or gap"), apart),
        Panel(f"{name} overlap", title.format("overlap alone"), inside),
        Panel(f"{name} motion", title.format("distance from a converged run"), astray),
    ]


def apart(task: Task, motion: Motion) -> float:
    """The larger of the deepest overlap and the gap."""
    return max(inside(task, motion), gap(task, motion))


@lru_cache(maxsize=1)
def inside(task: Task, motion: Motion) -> float:
    """Deepest overlap after any frame, in edges of the finer body of the two."""
    sound(task, motion)
    worst = max(overlap for overlap, _ in overlaps(task, motion))
    if worst >= TUNNELLED:
        raise Failed(f"bodies inside each other ({worst:.2g} edges)")
    gap(task, motion)  # bodies that went through each other have no overlap any more
    return worst


def astray(task: Task, motion: Motion) -> float:
    """Root mean square distance from the converged motion, in mean edges of the scene."""
    gap(task, motion)
    return rms_distance(task, motion.x, converged(task))


def rms_distance(task: Task, one: np.ndarray, other: np.ndarray) -> float:
    """Root mean square distance of two motions, in mean edges of the scene."""
    unit = np.mean([mean_edge(body.mesh) for body in task.scene().bodies])
    return float(np.sqrt(((one - other) ** 2).sum(axis=2).mean()) / unit)


@cache
def converged(task: Task, times: int = CONVERGED) -> np.ndarray:
    """Positions of the default at so many times the steps [m], shape (frames + 1, n, 3)."""
    steps = ours.run(task, ours.DEFAULT, None, np.inf).steps
    return ours.run(task, ours.DEFAULT, times * steps, np.inf).x


def overlaps(task: Task, motion: Motion):
    """After each frame the deepest overlap, in edges of the finer body, and the whole measure."""
    sim = wc.Simulation(task.scene(), fps=task.fps)
    for x in motion.x:
        sim.state.x.assign(np.ascontiguousarray(x, dtype=np.float32))
        measured = sim.measure()
        yield in_edges(sim, measured), measured


@lru_cache(maxsize=1)  # panels ask for it in turn
def gap(task: Task, motion: Motion) -> float:
    """Distance of the worst of the ``PRESSED`` pairs, in edges of its finer body.

    The median of the last frames: a hop between two impacts is no gap, one that stays is.
    """
    parts = zip(task.scene().bodies, sound(task, motion).parts, strict=True)
    found = {body.label: (body.mesh, part) for body, part in parts}
    worst = 0.0
    pairs = (pair for pair in PRESSED if found.keys() >= {*pair})
    for (one, here), (two, there) in (map(found.get, pair) for pair in pairs):
        frames = motion.x[late(task, LATE)]
        d = [distance(x[here], one.surface, x[there], two.surface) for x in frames]
        worst = max(worst, float(np.median(d)) / min(mean_edge(one), mean_edge(two)))
    if worst >= TUNNELLED:
        raise Failed(f"pressed bodies end apart ({worst:.2g} edges)")
    return worst
