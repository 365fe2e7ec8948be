"""The same few steps of a simulation again and again, captured and operation by operation."""

from collections import defaultdict
from dataclasses import dataclass
from itertools import pairwise
from statistics import mean, median
from time import perf_counter, thread_time
from typing import NamedTuple

import warp as wp

from clock.memory import Snapshot, held
from clock.timer import StageTimer
from warp_contact import Simulation
from warp_contact.frame.damping import share_for, stages_for
from warp_contact.step.loop import step_of
from warp_contact.step.motion import drift, predict

WORK = 60_000  # vertices times steps of a window
LEAST, MOST = 8, 64  # steps
ATTEMPTS = 4  # at a window whose contacts fit into the buffers


class Cost(NamedTuple):
    """What some operations cost in a step: their number, their time, the bytes given to them."""

    launches: float = 0.0
    ms: float = 0.0
    bytes: float = 0.0

    def __add__(self, other: "Cost") -> "Cost":
        """The sum of both."""
        return Cost(*(a + b for a, b in zip(self, other, strict=True)))


@dataclass(frozen=True)
class Timing:
    """One step on average over a window; each time in it is the median of its repeats."""

    steps: int  # in the window
    step_ms: float  # of the captured step, as simulations run it
    elastic_ms: float  # of a captured step without contact: predict, damping and drift
    contacts: float  # at the end of a step, mean over the window
    bytes: int  # in the arrays of model, state and work
    kernels: dict[tuple[str, str], Cost]  # of each kernel or memory operation, by stage and name

    @property
    def stages(self) -> dict[str, Cost]:
        """Cost of each stage."""
        found = defaultdict(Cost)
        for (stage, _), cost in self.kernels.items():
            found[stage] += cost
        return {k: c._replace(ms=max(0.0, c.ms)) for k, c in found.items()}

    @property
    def whole(self) -> Cost:
        """Cost of all operations."""
        return sum(self.stages.values(), Cost())

    @property
    def overhead_us(self) -> float:
        """Time of the captured step beyond the sum of its operations, for each of them."""
        return 1e3 * (self.step_ms - self.whole.ms) / self.whole.launches


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
    kernels = defaultdict(Cost)
    for same in zip(*operations, strict=True):  # repeats do the same in the same order
        ms = median(o.ms for o in same)
        kernels[same[0][:2]] += Cost(1.0 / steps, ms / steps, same[0].bytes / steps)
    return Timing(
        steps=steps,
        step_ms=_mean_of_medians(whole, steps),
        elastic_ms=_mean_of_medians(without, steps),
        contacts=mean(window.contacts),
        bytes=held(sim.model, sim.state, sim._stepper.work),
        kernels=dict(kernels),
    )


def _mean_of_medians(runs: tuple[list[float], ...], steps: int) -> float:
    return sum(median(times) for times in zip(*runs, strict=True)) / steps


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
        stepper.work.dt.fill_(stepper.dt)
    raise RuntimeError("contacts outgrow their buffers in every window")


class _Window:
    def __init__(self, sim: Simulation, steps: int):
        self._steps = steps
        stepper = sim._stepper
        self._work, self._device = stepper.work, sim.device
        self._work.share.fill_(share_for(stepper.rates[1], stepper.dt))
        self.step = step_of(sim.response, bool(stepper.overlapping))
        stages = stages_for(stepper.rates[1], stepper.dt)
        self._arguments = sim.model, sim.state, self._work, stages
        self._work.overflow.all.zero_()
        self._start = Snapshot(sim.state, self._work)
        self.contacts: list[int] = []

    def restore(self) -> None:
        self._start.restore()
        self._work.broad_phase.bodies.refit()
        self._work.broad_phase.surface.refit()

    def capture(self, step) -> wp.Graph:
        with wp.ScopedCapture() as capture:
            step(*self._arguments)
        return capture.graph

    def replay(self, graph: wp.Graph) -> list[float]:
        """Time of each step [ms]."""
        self.restore()
        cpu = self._device.is_cpu
        clock = thread_time if cpu else perf_counter
        wp.synchronize_device(self._device)
        marks = [clock()]
        for _ in range(self._steps):
            wp.capture_launch(graph)
            if not cpu:
                wp.synchronize_device(self._device)
            marks.append(clock())
        return [1e3 * (end - start) for start, end in pairwise(marks)]

    def operations(self) -> list:
        """Every operation of the window, in order."""
        self.restore()
        self.contacts.clear()
        with StageTimer(self._device) as timer:
            for _ in range(self._steps):
                self.step(*self._arguments)
                self.contacts.append(int(self._work.contacts.n.numpy()[0]))
        return timer.operations
