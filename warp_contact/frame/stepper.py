"""One frame of a simulation, repeated where its steps were too long or its buffers too small."""

from dataclasses import replace

import numpy as np
import warp as wp

from warp_contact.data import contact_forces, warm_start
from warp_contact.data.model import Model
from warp_contact.data.overflow import Capacity
from warp_contact.data.state import State
from warp_contact.data.work import Work, allocate_work
from warp_contact.errors import SimulationError
from warp_contact.frame import checkpoint
from warp_contact.frame.capacity import enlarged
from warp_contact.frame.damping import share_for, stages_for
from warp_contact.frame.diagnosis import lost_vertex
from warp_contact.frame.frame_start import FrameStart
from warp_contact.frame.overlap import overlaps
from warp_contact.frame.rates import NO_RATES, rates_now
from warp_contact.frame.sleeping import Sleeping
from warp_contact.frame.spectrum import Spectrum
from warp_contact.frame.step_bounds import (
    CUT_SHORT,
    RAISED,
    raised,
    served,
    stays_damped,
    stays_stable,
)
from warp_contact.frame.step_count import StepCount
from warp_contact.step.loop import step_of, take_steps
from warp_contact.step.motion import kick
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce

NEIGHBOURS = 8  # initial capacity: pairs with a contact force for each body
IMPULSE_UNIT = 1e-13  # momentum of one count of the recorded impulses, for all mobile mass at 1 m/s
HALVED = 3  # times at most that a step is halved because state or stiffness is not finite
PART = 8  # steps between two checks of the rates, in frames that begin or end with a flat tet
ATTEMPTS = 12  # at a frame, with shorter steps each time


class Stepper:
    """Steps a state frame by frame, in place.

    Attributes:
        fps: frames per second
        wanted: steps in a frame that the user chose, or None
        n: steps of the last frame
        dt: their length [s], None before the first
        rates: largest elastic frequency and damping rate at its end [1/s], None if to be found
        overlapping: whether there may be overlaps that no step created; None where it is not known
        work: buffers, with the contacts of the last step
        sleeping: which bodies sleep; None where none may
        spectrum: finds the rates
        unit: resolution of the recorded contact impulses [N s]
    """

    def __init__(
        self,
        model: Model,
        state: State,
        response: ContactSurface | Penalty | PredictedForce,
        fps: float,
        wanted: int | None,
        most: int,
        sleeping: bool,
    ):
        """Allocate what the steps need, on the current device."""
        self.fps, self.wanted = fps, wanted
        self.n = 0
        self.dt: float | None = None
        self.rates: tuple[float, float] | None = None
        self.overlapping: bool | None = None
        self._model, self._state, self._response = model, state, response
        self._step_count = StepCount(model, response, fps, wanted, most)
        self.spectrum = Spectrum(model)
        # Without gravity, a slow body may be in free flight, not at rest.
        may_sleep = sleeping and any(model.gravity)
        self.sleeping = Sleeping(model, state, fps) if may_sleep else None
        inv_mass = model.inv_mass.numpy()
        mobile = float(model.mass.numpy()[inv_mass > 0.0].sum(dtype=np.float64))
        self.unit = IMPULSE_UNIT * (mobile if mobile > 0.0 else 1.0)
        pairs = max(Capacity.pairs, NEIGHBOURS * model.n_body)
        self.work: Work = self._allocate(Capacity(pairs=pairs))
        self._graphs: dict[tuple[int, bool], wp.Graph] = {}
        self._start = FrameStart(state, self.work)

    def step(self, frame: int) -> None:
        """Step frame number ``frame``.

        A frame that outgrew its buffers, or whose step turned out too long for the deformation
        that came, is repeated from its start. If it begins or ends with a tet that is nearly
        flat, the rates are checked every ``PART`` steps.

        Whatever ends it early, an interrupt too, leaves all as the last frame had left it.

        Raises SimulationError where no step is stable or the state does not stay finite.
        """
        self._begin()
        try:
            if not self._all_sleep():
                self._step(frame)
        except BaseException:
            self._undo()
            raise

    def _step(self, frame: int) -> None:
        while self.overlapping is None or self.grow():
            self.overlapping = overlaps(self._model, self._state, self.work)
        self.dt, self.rates = self._find_step(frame)
        self.overlapping = self.overlapping and bool(self.work.surface.was_old.numpy()[0])

    def _all_sleep(self) -> bool:
        """Decide which bodies sleep; where all do, nothing moves in this frame."""
        if not self.sleeping:
            return False
        if self.overlapping is not False:  # an overlap that is left has to be searched
            return False
        if self.sleeping.update(self._state, self.work):
            return False
        self.sleeping.skip_frame(self._state, self.work)
        return True

    def _find_step(self, frame: int) -> tuple[float, tuple[float, float]]:
        """Step the frame until its step fits; return the step [s] and the last rates."""
        omega, rate = self.rates or self.spectrum.rates(self._state.x)
        self._step_count.check(self._state, omega, frame)
        last, halved = self.n, 0
        in_parts = self._flat()
        for _ in range(ATTEMPTS):
            dt, after, wrong = self._run(omega, rate, last, frame, in_parts)
            while self.grow():
                dt, after, wrong = self._run(omega, rate, last, frame, in_parts)
            fits = not wrong and self._fits(dt, rate, after)
            flat = in_parts or bool(wrong) or self._flat()
            if fits and (in_parts or not flat):
                return dt, after
            self._start.go_back(self._state, self.work)
            if wrong:
                if self.wanted or halved == HALVED or lost_vertex(self._state) is not None:
                    raise SimulationError(f"frame {frame}: {wrong} ({self.n} substeps)")
                halved += 1
                omega, rate = 2.0 * max(omega, served(dt)), 2.0 * rate
            elif not fits:
                least = CUT_SHORT if in_parts else RAISED
                omega, rate = raised((omega, rate), after, dt, least)
            in_parts = flat
        raise SimulationError(f"frame {frame}: no stable step found ({self.n} substeps)")

    def _flat(self) -> bool:
        """Whether a tet was flat at the last check, and the number of steps is free."""
        return self.wanted is None and self.spectrum.flat

    def _fits(self, dt: float, rate: float, after: tuple[float, float]) -> bool:
        """Whether steps ``dt`` [s] for damping at a ``rate`` [1/s] fit the rates ``after`` them."""
        stable = self.wanted is not None or stays_stable(dt, after[0], rate)
        return stable and stays_damped(dt, rate, after[1])

    def look_anew(self) -> None:
        """Positions were set from outside: find overlaps and rates before the next frame."""
        self.overlapping = None
        self.rates = None
        if self.sleeping:
            self.sleeping.wake_all(self.work)

    def use(self, work: Work) -> None:
        """Continue with other buffers."""
        self.work = work
        work.forces.unit = self.unit
        self._graphs.clear()

    def grow(self) -> bool:
        """Enlarge the buffers that the frame outgrew, and go back to its start; True if any."""
        capacity = enlarged(self.work)
        if capacity is None:
            return False
        forces = self.work.forces
        self._replace_work(capacity)
        self._start.go_back(self._state, self.work)
        if self.sleeping:
            contact_forces.copy(self.work.forces, forces)
        return True

    def values(self) -> dict[str, np.ndarray]:
        """What a checkpoint needs, beside the state."""
        values = {"substeps": np.array(self.n)}
        values |= {f"start.{k}": start for k, start in self.spectrum.starts().items()}
        values |= {f"warm.{k}": value for k, value in warm_start.values(self.work.warm).items()}
        if self.sleeping:
            values |= {
                f"sleeping.{k}": value for k, value in self.sleeping.values(self.work).items()
            }
        if self.overlapping is not None:
            values |= {"overlapping": np.array(self.overlapping)}
        if self.dt is not None:
            values |= {"dt": np.array(self.dt)}
        if self.rates is not None:
            values |= {"rates": np.array(self.rates)}
        return values

    def restore(self, values: dict[str, np.ndarray]) -> None:
        """Take over the ``values`` of another instance with the same scene and settings."""
        self.n = int(values["substeps"])
        self.spectrum.start_from(checkpoint.group(values, "start"))
        sleeping = checkpoint.group(values, "sleeping")
        impulses = checkpoint.group(values, "warm")
        have = self.work.capacity
        pairs = max(have.pairs, len(sleeping.get("pair_key", ())))
        contacts = max(have.contacts, len(impulses["edges"]))
        self._replace_work(replace(have, pairs=pairs, contacts=contacts))
        warm_start.restore(self.work.warm, impulses)
        if self.sleeping:
            self.sleeping.restore(sleeping, self.work)
        self.overlapping = bool(values["overlapping"]) if "overlapping" in values else None
        self.dt = float(values["dt"]) if "dt" in values else None
        self.rates = tuple(map(float, values["rates"])) if "rates" in values else None

    def _run(
        self, omega: float, rate: float, last: int, frame: int, in_parts: bool
    ) -> tuple[float, tuple[float, float], str]:
        """Step the frame at the rates [1/s] given, after ``last`` steps.

        Return the step [s] and what ``rates_now`` finds at the end. With ``in_parts`` the frame
        ends as soon as its step no longer fits. Where buffers were too small, nothing was found.
        """
        work = self.work
        if self.sleeping:
            self.sleeping.begin_frame(self._state, work)
        else:
            work.forces.received.zero_()
            work.forces.pair_key.fill_(-1)
            work.forces.pair_total.zero_()
        given = omega, self.spectrum.stiffest, last, frame, bool(self.overlapping)
        n = self._step_count.steps(self._state, *given)
        dt = 1.0 / (self.fps * n)
        damping_stages = stages_for(rate, dt)
        if self.dt is not None and dt != self.dt:
            work.dt.fill_(0.5 * (self.dt - dt))
            kick(self._model, self._state, work)  # velocities lag by half a step
        work.dt.fill_(dt)
        work.share.fill_(share_for(rate, dt))
        work.overflow.all.zero_()
        work.surface.was_old.zero_()
        work.broad_phase.bodies.rebuild()
        self.n = n
        after, wrong = NO_RATES, ""
        part = PART if in_parts else n
        for first in range(0, n, part):
            work.steps.fill_(min(part, n - first))
            wp.capture_launch(self._graph(damping_stages))
            if enlarged(work) is not None:
                break
            after, wrong = rates_now(self._model, self._state, self.spectrum)
            if wrong or not self._fits(dt, rate, after):
                break
        return dt, after, wrong

    def _graph(self, damping_stages: int) -> wp.Graph:
        """The captured steps of a frame, with so many stages of damping."""
        key = damping_stages, self.overlapping
        if key not in self._graphs:
            one = step_of(self._response, bool(self.overlapping))
            with wp.ScopedCapture() as capture:
                take_steps(self._model, self._state, self.work, damping_stages, one)
            self._graphs[key] = capture.graph
        return self._graphs[key]

    def _allocate(self, capacity: Capacity) -> Work:
        awake = self.sleeping.awake if self.sleeping else None
        return allocate_work(self._model, self._state, capacity, awake, self.unit)

    def _replace_work(self, capacity: Capacity) -> None:
        """Free the buffers, then allocate: old and new ones at once would be the peak of memory."""
        before = self.work.capacity
        self._graphs.clear()
        del self.work
        try:
            self.work = self._allocate(capacity)
        except RuntimeError:  # there is no memory for it
            self.work = self._allocate(before)
            raise

    def _begin(self) -> None:
        """Keep what a frame changes."""
        self._start.keep(self._state, self.work)
        self._choice = self.n, self.dt, self.rates, self.overlapping
        self.spectrum.save()
        if self.sleeping:
            self.sleeping.save()

    def _undo(self) -> None:
        """Leave the frame as if it had not begun, wherever it was interrupted."""
        self.n, self.dt, self.rates, self.overlapping = self._choice
        self.spectrum.undo()
        if self.sleeping:
            self.sleeping.undo()
        if not hasattr(self, "work"):  # interrupted while the buffers grew
            self.work = self._allocate(Capacity(pairs=self._start.n_pair))
        self._start.undo(self._state, self.work)
