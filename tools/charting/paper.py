"""Panels with scenes of the paper: distances of surfaces, and from a converged run.

Surfaces that press on each other ought to be at distance zero, so an overlap is an error and a gap
is one too: a method that keeps bodies apart by a margin has no overlap, and a gap that can be seen.

The motion has no closed form. It is compared with that of the default at ``CONVERGED`` times the
steps, which half as many change by 1e-4 to 2e-4 of an edge. The reference is our own, so for our
methods the figure tells how consistent they are. Others confirm it: the stiffest penalty and the
predicted forces come within 0.3 to 1.2 % of an edge of it. An engine with another law of elasticity
moves otherwise by the difference of the laws, which no part of this figure takes out.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import warp as wp
from verification.scenes import in_edges

import warp_contact as wc
from charting import ours
from charting import panel as parts
from charting.distance import distance
from charting.methods import Own
from charting.panel import TUNNELLED, Failed, Motion, Panel
from warp_contact import scenes

FPS = 60
DURATION, QUICK = 1.0, 0.5  # [s]
CONVERGED = 16  # times the steps
LATE = 0.25  # part of the frames at the end in which the bodies of a pair touch
TITLES = {
    "squeezed_sphere": "squeezed sphere",
    "cubes_on_membrane": "cubes on a membrane 1:4:16",
}
PRESSED = {  # bodies that are squeezed together, or rest on each other, by their labels
    "squeezed_sphere": (("lower_cube", "sphere"), ("sphere", "upper_cube")),
    "cubes_on_membrane": tuple(("membrane", f"cube_{mass}") for mass in (1, 4, 16)),
}


@cache
def scene(name: str, quick: bool) -> Panel:
    """A scene of the paper; its overlap alone and its motion are further panels."""
    module = scenes.load(name)
    frames = round((QUICK if quick else DURATION) * FPS)
    title = f"{TITLES[name]}\n{{}} [of an edge]"
    shown = title.format("overlap, or gap where bodies press on each other")
    panel = Panel(name, shown, module.build, FPS, frames, apart, **module.PENALTY)
    shown = title.format("overlap alone, which a margin hides")
    overlap = replace(panel, name=f"{name} overlap", title=shown, error=inside)
    shown = title.format("distance from a converged run, rms of all vertices and frames")
    motion = replace(panel, name=f"{name} motion", title=shown, error=astray)
    return replace(panel, also=(overlap, motion))


def astray(panel: Panel, motion: Motion) -> float:
    """Root mean square distance from the converged motion, in mean edges of the scene."""
    parts.sound(panel, motion)
    gap(panel, motion)
    return rms_distance(panel, motion.x, converged(panel))


def rms_distance(panel: Panel, one: np.ndarray, other: np.ndarray) -> float:
    """Root mean square distance of two motions, in mean edges of the scene."""
    unit = np.mean([edge(body.mesh) for body in panel.scene().bodies])
    return float(np.sqrt(((one - other) ** 2).sum(axis=2).mean()) / unit)


@cache
def converged(panel: Panel, times: int = CONVERGED) -> np.ndarray:
    """Positions of the default at so many times the steps [m], shape (frames + 1, n, 3)."""
    setting = Own("default", "balanced")
    steps = ours.run(panel, setting, None, np.inf).steps
    return ours.run(panel, setting, times * steps, np.inf).x


def apart(panel: Panel, motion: Motion) -> float:
    """The larger of the deepest overlap and the gap."""
    return max(deepest(panel, motion), gap(panel, motion))


def inside(panel: Panel, motion: Motion) -> float:
    """The deepest overlap, of bodies that are still where they can have one."""
    worst = deepest(panel, motion)
    gap(panel, motion)
    return worst


def deepest(panel: Panel, motion: Motion) -> float:
    """Deepest overlap after any frame, in edges of the finer body of the two."""
    parts.sound(panel, motion)
    sim = wc.Simulation(panel.scene(), fps=panel.fps)
    worst = 0.0
    for x in motion.x:
        sim.state.x.assign(np.ascontiguousarray(x, dtype=np.float32))
        with wp.ScopedDevice(sim.device):
            worst = max(worst, in_edges(sim, sim.measure()))
    if worst >= TUNNELLED:
        raise Failed(f"bodies inside each other ({worst:.2g} edges)")
    return worst


def gap(panel: Panel, motion: Motion) -> float:
    """Distance of the worst pair of ``PRESSED``, in edges of its finer body.

    The median of the last frames: a hop between two impacts is no gap, one that stays is. Bodies
    that went through each other have no overlap any more, but end further apart than an edge.
    """
    built = panel.scene()
    bodies = {body.label: body for body in built.bodies}
    late = motion.x[-max(2, round(LATE * panel.frames)) :]
    worst = 0.0
    for pair in PRESSED[panel.name.split()[0]]:
        one, two = (bodies[label] for label in pair)
        here, there = (parts.part(built, body.index) for body in (one, two))
        tris = one.mesh.surface, two.mesh.surface
        d = [distance(x[here], tris[0], x[there], tris[1]) for x in late]
        worst = max(worst, float(np.median(d)) / min(edge(one.mesh), edge(two.mesh)))
    if worst >= TUNNELLED:
        raise Failed(f"pressed bodies end apart ({worst:.2g} edges)")
    return worst


def edge(mesh: wc.TetMesh) -> float:
    """Mean edge at rest [m], as overlaps are measured in."""
    return float(np.linalg.norm(np.diff(mesh.vertices[mesh.edges], axis=1), axis=2).mean())
