"""The same few steps of a simulation again and again, captured and stage by stage."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import mean, median
from time import perf_counter, thread_time

import warp as wp

from benching.memory import Snapshot, held
from benching.stages import OTHER, STAGES, StageTimer
from warp_contact import Simulation
from warp_contact.step import step as stages
from warp_contact.step.forces import share_for, stages_for

WORK = 60_000  # vertices times steps of a window
LEAST, MOST = 8, 64  # steps
ATTEMPTS = 4  # at a window whose contacts fit into the buffers


@dataclass(frozen=True)
class Timing:
    """One step on average over a window; each time in it is the median of its repeats.

    Attributes:
        steps: in the window
        step_ms: of the captured step, as simulations run it
        elastic_ms: of a captured step without contact: predict, damping and drift
        contacts: at the end of a step, mean over the window
        launches: of each stage, mean over the window: kernels and memory operations
        ms: of each stage: sum of these operations
        given: bytes of the arrays given to the operations of each stage, mean over the window
        kernels: (launches, ms) of each operation, as stage and name
        bytes: in the arrays of model, state and work
    """

    steps: int
    step_ms: float
    elastic_ms: float
    contacts: float
    launches: dict[str, float]
    ms: dict[str, float]
    given: dict[str, float]
    kernels: dict[tuple[str, str], tuple[float, float]]
    bytes: int

    @property
    def shares(self) -> dict[str, float]:
        """Part of each stage in the sum of all."""
        total = sum(self.ms.values()) or 1.0  # a clock may be too coarse for all of them
        return {stage: ms / total for stage, ms in self.ms.items()}

    @property
    def overhead_us(self) -> float:
        """Time of the captured step beyond the sum of its operations, for each of them."""
        return 1e3 * (self.step_ms - sum(self.ms.values())) / sum(self.launches.values())


def measure(sim: Simulation, repeats: int, steps: int | None = None) -> Timing:
    """Time a window of steps that begins at the last finished frame; needs one.

    The simulation is left as it was, or with larger buffers if contacts outgrew them.
    """
    steps = steps or min(MOST, max(LEAST, WORK // sim.model.n_vert))
    with wp.ScopedDevice(sim.device):
        for _ in range(ATTEMPTS):
            window = _Window(sim, steps)
            window.stages()
            needed = sim._stepper.work.contacts.needed.numpy().copy()
            if not needed.any():
                break
            window.restore()
            sim._stepper.work.contacts.needed.assign(needed)
            sim._stepper.grow()
            sim._stepper.work.dt.fill_(sim._stepper.dt)
        else:
            raise RuntimeError("contacts outgrow their buffers in every window")
        step, elastic = window.capture(stages.step), window.capture(_elastic)
        runs = []
        for _ in range(repeats):
            runs.append((window.replay(step), window.replay(elastic), window.stages()))
        window.restore()
    whole, without, spent = (_medians(times) for times in zip(*runs, strict=True))
    kernels: dict[tuple[str, str], list[float]] = defaultdict(lambda: [0.0, 0.0])
    for key, ms in zip(window.operations, spent, strict=True):
        kernels[key][0] += 1.0 / steps
        kernels[key][1] += ms / steps
    launches, ms, given = (defaultdict(float) for _ in range(3))
    for (stage, _), size in zip(window.operations, window.sizes, strict=True):
        given[stage] += size / steps
    for (stage, _), (n, time) in kernels.items():
        launches[stage] += n
        ms[stage] += time
    found = [stage for stage in (*STAGES, OTHER) if launches[stage]]
    return Timing(
        steps=steps,
        step_ms=sum(whole) / steps,
        elastic_ms=sum(without) / steps,
        contacts=mean(window.contacts),
        launches={stage: launches[stage] for stage in found},
        ms={stage: max(0.0, ms[stage]) for stage in found},
        given={stage: given[stage] for stage in found},
        kernels={key: tuple(of) for key, of in kernels.items()},
        bytes=held(sim.model, sim.state, sim._stepper.work),
    )


def _medians(runs: Sequence[Sequence[float]]) -> list[float]:
    """Of each entry over the runs, which do the same in the same order."""
    return [median(times) for times in zip(*runs, strict=True)]


def _elastic(model, state, work, response, damping_stages, search, unit) -> None:
    stages.predict(model, state, work, damping_stages)
    stages.drift(model, state, work, state.x)


class _Window:
    def __init__(self, sim: Simulation, steps: int):
        self._steps = steps
        stepper = sim._stepper
        self._work, self._device = stepper.work, sim.device
        stages = stages_for(stepper.rates[1], stepper.dt)
        self._work.share.fill_(share_for(stepper.rates[1], stepper.dt))
        self._arguments = sim.model, sim.state, self._work, sim.response, stages
        self._arguments += stepper.search, stepper.unit
        self._work.contacts.needed.zero_()
        self._start = Snapshot(sim.state, self._work)
        self.contacts: list[int] = []
        self.operations: list[tuple[str, str]] = []
        self.sizes: list[int] = []

    def restore(self) -> None:
        self._start.restore()
        self._work.bodies.refit()
        self._work.surface.refit()

    def capture(self, step) -> wp.Graph:
        with wp.ScopedCapture() as capture:
            step(*self._arguments)
        return capture.graph

    def replay(self, graph: wp.Graph) -> list[float]:
        """Time of each step [ms]; on a GPU, where steps queue up, that of all."""
        self.restore()
        clock = thread_time if self._device.is_cpu else perf_counter
        wp.synchronize_device(self._device)
        marks = [clock()]
        for _ in range(self._steps):
            wp.capture_launch(graph)
            if self._device.is_cpu:
                marks.append(clock())
        if not self._device.is_cpu:
            wp.synchronize_device(self._device)
            marks.append(clock())
        return [1e3 * (end - start) for start, end in pairwise(marks)]

    def stages(self) -> list[float]:
        """Time of each of the ``operations`` [ms]."""
        self.restore()
        self.contacts.clear()
        with StageTimer(self._device) as timer:
            for _ in range(self._steps):
                stages.step(*self._arguments)
                self.contacts.append(int(self._work.contacts.n.numpy()[0]))
        self.operations, self.sizes = timer.operations, timer.bytes
        return timer.ms
