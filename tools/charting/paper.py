"""Panels with scenes of the paper: the deepest overlap, by the measure of this package."""

from functools import cache

import numpy as np
import warp as wp
from checks.scenes import in_edges

import warp_contact as wc
from charting import panel as parts
from charting.panel import TUNNELLED, Failed, Motion, Panel
from warp_contact import scenes

FPS = 60
DURATION, QUICK = 1.0, 0.5  # [s]
TITLES = {
    "squeezed_sphere": "squeezed sphere",
    "cubes_on_membrane": "cubes on a membrane 1:4:16",
}


@cache
def scene(name: str, quick: bool) -> Panel:
    """A scene of the paper."""
    module = scenes.load(name)
    title = f"{TITLES[name]}\ndeepest overlap after any frame [of an edge]"
    frames = round((QUICK if quick else DURATION) * FPS)
    return Panel(name, title, module.build, FPS, frames, deepest, **module.PENALTY)


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
        raise Failed(f"bodies inside each other by {worst:.2g} edges")
    return worst
