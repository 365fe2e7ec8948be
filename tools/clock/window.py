"""The same few steps of a simulation again and again, captured and operation by operation."""

from collections import defaultdict
from statistics import mean, median
from typing import NamedTuple

import numpy as np
import warp as wp

from clock.timer import StageTimer, arrays, held, milliseconds
from warp_contact import Simulation
from warp_contact.frame.damping import prepare
from warp_contact.step.loop import step_of
from warp_contact.step.motion import drift, predict

WORK = 60_000  # vertices times steps of a window
LEAST, MOST = 8, 64  # steps
ATTEMPTS = 4  # at a window whose contacts fit into the buffers


class Cost(NamedTuple):
    """What the operations of a stage cost in a step: their number and their time."""

    launches: float
    ms: float


class Timing(NamedTuple):
    """One step on average over a window; each time in it is the median of its repeats."""

    steps: int  # in the window
    step_ms: float  # of the captured step, as simulations run it
    elastic_ms: float  # of a captured step without contact: predict, damping and drift
    contacts: float  # at the end of a step, mean over the window
    bytes: int  # in the arrays of model, state and work
    stages: dict[str, Cost]


def measure(sim: Simulation, repeats: int, steps: int | None = None) -> Timing:
    """Time a window of steps that begins at the last finished frame; needs one.

    The simulation is left as it was, or with larger buffers if contacts outgrew them.
    """
    steps = steps or min(MOST, max(LEAST, WORK // sim.model.n_vert))
    with wp.ScopedDevice(sim.device):
        window = _fitting(sim, steps)
        step, elastic = window.capture(window.step), window.capture(_elastic)
        runs = []
        for _ in range(repeats):
            runs.append((window.replay(step), window.replay(elastic), window.operations()))
        window.restore()
    whole, without, operations = zip(*runs, strict=True)
    times = defaultdict(list)
    for same in zip(*operations, strict=True):  # repeats do the same in the same order
        times[same[0][0]].append(median(ms for _, ms in same))
    stages = {k: Cost(len(ms) / steps, max(0.0, sum(ms)) / steps) for k, ms in times.items()}
    step_ms, elastic_ms = (
        sum(median(same) for same in zip(*of, strict=True)) / steps for of in (whole, without)
    )
    everything = held(sim.model, sim.state, sim._stepper.work)
    return Timing(steps, step_ms, elastic_ms, mean(window.contacts), everything, stages)


def _elastic(model, state, work, stages: int) -> None:
    predict(model, state, work, stages)
    drift(model, state, work, state.x)


def _fitting(sim: Simulation, steps: int) -> "_Window":
    """A window whose contacts fit into the buffers."""
    for _ in range(ATTEMPTS):
        window, stepper = _Window(sim, steps), sim._stepper
        window.operations()
        needed = stepper.work.overflow.all.numpy().copy()
        if not needed.any():
            return window
        window.restore()
        stepper.work.overflow.all.assign(needed)
        stepper.grow()
    raise RuntimeError("contacts outgrow their buffers in every window")


class _Window:
    def __init__(self, sim: Simulation, steps: int):
        stepper = sim._stepper
        self._steps, self._work, self._device = steps, stepper.work, sim.device
        self._work.dt.assign(stepper.last_dt)
        self._work.overflow.all.zero_()
        self._work.worlds.apart.assign((stepper.last.overlapping < 1).astype(np.int32))
        self.step = step_of(sim.response, bool((stepper.last.overlapping > 0).any()))
        last = stepper.last
        given = last.rates[1], last.dt, stepper.worlds.of_vert, last.dt
        stages = prepare(self._work.damping, *given)
        self._arguments = sim.model, sim.state, self._work, stages
        self._start = [(a, wp.clone(a)) for a in arrays((sim.state, self._work)) if a.size]
        self.contacts: list[int] = []

    def restore(self) -> None:
        for a, copy in self._start:
            wp.copy(a, copy)
        self._work.broad_phase.bodies.refit()
        self._work.broad_phase.surface.refit()

    def capture(self, step) -> wp.Graph:
        with wp.ScopedCapture() as capture:
            step(*self._arguments)
        return capture.graph

    def replay(self, graph: wp.Graph) -> list[float]:
        """Time of each step [ms]."""
        self.restore()
        wp.synchronize_device(self._device)
        return [milliseconds(self._device, wp.capture_launch, graph) for _ in range(self._steps)]

    def operations(self) -> list[tuple[str, float]]:
        """Stage and time [ms] of every operation of the window, in order."""
        self.restore()
        self.contacts.clear()
        with StageTimer(self._device) as timer:
            for _ in range(self._steps):
                self.step(*self._arguments)
                self.contacts.append(int(self._work.contacts.n.numpy()[0]))
        return timer.operations
