"""The methods of this package with their knobs, and how each runs a task."""

from contextlib import nullcontext
from typing import NamedTuple

import numpy as np

import warp_contact as wc
from engines.job import play
from engines.task import Motion, Task
from warp_contact.data.switches import without


class Own(NamedTuple):
    """A method at one setting."""

    method: str
    iterations: int = 0  # of the search of a contact surface; 0 where none is swept
    times: float = 0.0  # stiffness of a penalty over that of the task; 0 for other responses
    factor: int = 1  # substeps over those that the simulation takes by itself; 1 leaves it to it
    steps: int | None = None  # of a frame, where no factor says it

    def __str__(self):
        """The knobs."""
        knob = f"stiffness x{self.times:g}, " if self.times else ""
        knob += f"iterations {self.iterations}, " if self.iterations else ""
        return f"{knob}steps {self.steps or f'x{self.factor}'}"

    def response(self, task: Task):
        """For a task; the damping of a penalty keeps its ratio."""
        if self.times:
            kind = wc.VirtualSurface if self.method == "virtual" else wc.Penalty
            return kind(self.times * task.stiffness, self.times**0.5 * task.damping)
        if self.method == "predicted":
            return wc.PredictedForce()
        search = "literal" if self.method == "literal" else "balanced"
        return wc.ContactSurface(search, self.iterations or DEFAULT.iterations)


DEFAULT, IMPLICIT = Own("default", 4), Own("implicit")
STIFFNESSES = 0.01, 0.1, 1.0, 10.0, 100.0  # of that of the task
ALL = [
    *(DEFAULT._replace(factor=f) for f in (1, 2, 4)),
    *(IMPLICIT._replace(steps=n) for n in (None, 2, 4, 8, 16, 32)),
    *(Own(name, factor=f) for name in ("impulses alone", "predicted") for f in (1, 2, 4)),
    *(Own("literal", n, factor=f) for n in (4, 16) for f in (1, 2, 4)),
    *(Own(name, 0, k, f) for name in ("penalty", "virtual") for k in STIFFNESSES for f in (1, 2)),
]


class Engine(wc.Simulation):
    """A simulation whose held vertices can be stopped."""

    def halt(self) -> None:
        """Held vertices stand still from now on."""
        for body in self.scene.bodies:
            if body.fixed.any():
                self.set_velocity(body, (0.0, 0.0, 0.0), body.fixed)


def run(task: Task, setting: Own, substeps: int | None, limit: float) -> Motion:
    """The motion in a task; without ``substeps`` their number is left to the simulation."""

    def make() -> Engine:
        how = {"integrator": "implicit" if setting.method == "implicit" else "explicit"}
        sim = Engine(task.scene(), setting.response(task), task.fps, substeps, "cpu", **how)
        sim.state.x.assign(task.start(sim.scene).astype(np.float32))
        return sim

    # To leave out the stage that moves surfaces is no option of the package.
    leave_out = without if setting.method == "impulses alone" else nullcontext
    with leave_out("search"), leave_out("closure"):
        try:
            return Motion(**play(make, task.fps, task.frames, task.stop, limit))
        except (wc.SimulationError, ValueError) as error:  # or no implicit steps are possible
            return Motion(reason=str(error))
