"""Run a panel with a response of this package."""

from contextlib import nullcontext
from time import perf_counter
from unittest import mock

import numpy as np

import warp_contact as wc
from charting.methods import Own
from charting.panel import Failed, Motion, Panel, placed
from warp_contact.step import step


def run(panel: Panel, setting: Own, substeps: int | None, limit: float) -> Motion:
    """The motion in a panel at a setting; arguments as in ``play``.

    Without surfaces the last stage of a step is left out. It is no option of the package.
    """
    still = nullcontext() if setting.surfaces else mock.patch.object(step, "move_surfaces")
    with still:
        return play(panel, setting.response(panel), substeps, limit)


def play(panel: Panel, response, substeps: int | None, limit: float) -> Motion:
    """Every frame, on the CPU as in other engines; the first one, which compiles, is not timed.

    Args:
        panel: what to run
        response: of this package
        substeps: in each frame; None leaves the number to the simulation
        limit: wall seconds after which the run is given up
    """
    begin = perf_counter()
    scene = panel.scene()
    sim = wc.Simulation(scene, response, fps=panel.fps, substeps=substeps, device="cpu")
    sim.state.x.assign(placed(panel, scene).astype(np.float32))
    x, v = [sim.positions()], [sim.velocities()]
    startup, wall = 0.0, 0.0
    for frame in range(1, panel.frames + 1):
        if frame - 1 == panel.stop:
            _halt(sim)
        start = perf_counter()
        try:
            sim.step_frame()
        except wc.SimulationError as error:
            raise Failed(str(error)) from None
        if frame == 1:
            startup = perf_counter() - begin
        else:
            wall += perf_counter() - start
        x.append(sim.positions())
        v.append(sim.velocities())
        if wall > limit and frame < panel.frames:
            reason = f"too slow: {frame} of {panel.frames} frames in {limit:.3g} s"
            raise Failed(reason, wall * panel.fps / (frame - 1))
    seconds = (panel.frames - 1) / panel.fps
    law = "neo-hookean"
    return Motion(np.array(x), np.array(v), law, wall / seconds, startup, sim.substeps)


def _halt(sim: wc.Simulation) -> None:
    for body in sim.scene.bodies:
        if body.fixed.any():
            sim.set_velocity(body, (0.0, 0.0, 0.0), body.fixed)
