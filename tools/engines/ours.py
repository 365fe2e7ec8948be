"""Run a task with a response of this package."""

from contextlib import ExitStack
from functools import partial

import numpy as np

import warp_contact as wc
from engines.job import play
from engines.settings import Own
from engines.task import Failed, Motion, Task
from warp_contact.data.switches import without


class Engine:
    """A simulation, on the CPU as in other engines."""

    def __init__(self, task: Task, response, substeps: int | None):
        """Put the bodies where they start."""
        scene = task.scene()
        self.sim = wc.Simulation(scene, response, task.fps, substeps, device="cpu")
        self.sim.state.x.assign(task.placed(scene).astype(np.float32))

    def step_frame(self) -> None:
        """One frame."""
        self.sim.step_frame()

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions [m] and velocities [m/s]."""
        return self.sim.positions(), self.sim.velocities()

    def halt(self) -> None:
        """Held vertices stand still from now on."""
        for body in self.sim.scene.bodies:
            if body.fixed.any():
                self.sim.set_velocity(body, (0.0, 0.0, 0.0), body.fixed)

    @property
    def steps(self) -> int:
        """Of the last frame."""
        return self.sim.substeps


def run(task: Task, setting: Own, substeps: int | None, limit: float) -> Motion:
    """The motion in a task.

    Without surfaces the last stage of a step is left out. It is no option of the package.

    Args:
        task: what to run
        setting: with what
        substeps: in each frame; None leaves the number to the simulation
        limit: wall seconds after which the run is given up
    """
    make = partial(Engine, task, setting.response(task), substeps)
    with ExitStack() as still:
        for part in () if setting.surfaces else ("search", "closure"):
            still.enter_context(without(part))
        try:
            found = play(make, task.fps, task.frames, task.stop, limit)
        except wc.SimulationError as error:
            raise Failed(str(error)) from None
    if "reason" in found:
        raise Failed(**found)
    return Motion(law="neo-hookean", **found)
