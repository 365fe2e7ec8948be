"""One frame of a simulation, repeated where its steps were too long or its buffers too small."""

from dataclasses import replace

import numpy as np
import warp as wp

from warp_contact.data import contact_forces, contacts, damping, warm_start
from warp_contact.data.damping import MOST
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.errors import SimulationError
from warp_contact.frame import between, checkpoint
from warp_contact.frame.buffers import Buffers
from warp_contact.frame.capacity import enlarged
from warp_contact.frame.damping import prepare, stages_for
from warp_contact.frame.diagnosis import lost_vertex
from warp_contact.frame.frame_start import FrameStart
from warp_contact.frame.last_frame import LastFrame, last_frame_of
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
from warp_contact.step.damping import scale_contacts
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce
from warp_contact.step.velocity import answer_of, shift_velocities, velocities_now

HALVED = 3  # times at most that a step is halved because state or stiffness is not finite
PART = 8  # steps between two checks of the rates, in frames that begin or end with a flat tet
ATTEMPTS = 12  # at a frame, with shorter steps each time


class Stepper:
    """Steps a state frame by frame, in place.

    Attributes:
        fps: frames per second
        wanted: steps in a frame that the user chose, or None
        last: numbers of the last frame
        first: positions [m] and velocities [m/s] before the first frame, shape (n_vert, 3)
        buffers: what the steps fill
        sleeping: which bodies sleep; None where none may
        spectrum: finds the rates
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
        self.last = LastFrame()
        self.first = state.x.numpy().copy(), state.v.numpy().copy()
        self._model, self._state = model, state
        self._step_count = StepCount(model, response, fps, wanted, most)
        self.spectrum = Spectrum(model)
        # Without gravity, a slow body may be in free flight, not at rest.
        may_sleep = sleeping and any(model.gravity)
        self.sleeping = Sleeping(model, state, fps) if may_sleep else None
        awake = self.sleeping.awake if self.sleeping else None
        self.buffers = Buffers(model, state, response, awake)
        self._start = FrameStart(state, self.work)

    @property
    def work(self) -> Work:
        """Buffers, with the contacts of the last step."""
        return self.buffers.work

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
        overlapping = self.last.overlapping
        while overlapping is None or self.grow():
            overlapping = overlaps(self._model, self._state, self.work)
        self._overlapping = overlapping
        dt, rates = self._find_step(frame)
        old = overlapping and bool(self.work.surface.was_old.numpy()[0])
        self.last = LastFrame(self._n, dt, rates, old)

    def _all_sleep(self) -> bool:
        """Decide which bodies sleep; where all do, nothing moves in this frame."""
        if not self.sleeping:
            return False
        if self.last.overlapping is not False:  # an overlap that is left has to be searched
            return False
        if self.sleeping.update(self._state, self.work):
            return False
        self.sleeping.skip_frame(self._state, self.work)
        return True

    def _find_step(self, frame: int) -> tuple[float, tuple[float, float]]:
        """Step the frame until its step fits; return the step [s] and the last rates."""
        omega, rate = self.last.rates or self.spectrum.rates(self._state.x)
        self._step_count.check(self._state, omega, frame)
        halved = 0
        in_parts = self._flat()
        for _ in range(ATTEMPTS):
            dt, after, wrong = self._run(omega, rate, frame, in_parts)
            fits = not wrong and self._fits(dt, rate, after)
            while fits and self.grow():  # what explodes would ask for any number of pairs
                dt, after, wrong = self._run(omega, rate, frame, in_parts)
                fits = not wrong and self._fits(dt, rate, after)
            flat = in_parts or bool(wrong) or self._flat()
            if fits and (in_parts or not flat):
                return dt, after
            self._start.go_back(self._state, self.work)
            if wrong:
                if self.wanted or halved == HALVED or lost_vertex(self._state) is not None:
                    raise SimulationError(f"frame {frame}: {wrong} ({self._n} substeps)")
                halved += 1
                omega, rate = 2.0 * max(omega, served(dt)), 2.0 * rate
            elif not fits:
                least = CUT_SHORT if in_parts else RAISED
                omega, rate = raised((omega, rate), after, dt, least)
            in_parts = flat
        raise SimulationError(f"frame {frame}: no stable step found ({self._n} substeps)")

    def _flat(self) -> bool:
        """Whether a tet was flat at the last check, and the number of steps is free."""
        return self.wanted is None and self.spectrum.flat

    def _fits(self, dt: float, rate: float, after: tuple[float, float]) -> bool:
        """Whether steps ``dt`` [s] for damping at a ``rate`` [1/s] fit the rates ``after`` them."""
        stable = self.wanted is not None or stays_stable(dt, after[0])
        return stable and stays_damped(dt, rate, after[1])

    def velocities(self) -> np.ndarray:
        """Velocities [m/s] at the time of the positions, shape (n_vert, 3)."""
        self._start.keep(self._state, self.work)
        found, forces = contacts.copied(self.work.contacts), contact_forces.copied(self.work.forces)
        now = self._velocities()
        while self.grow():
            now = self._velocities()
        contacts.copy(self.work.contacts, found)
        contact_forces.copy(self.work.forces, forces)
        return now.numpy()

    def set_velocities(self, values: np.ndarray, at: np.ndarray, body: int) -> None:
        """Set ``values`` [m/s], shape (k, 3), at vertices ``at`` (k,) of a body."""
        between.set_velocities(self._model, self._state, self.work, self.last, values, at)
        if self.sleeping:
            self.sleeping.wake(body)

    def set_positions(self, x: np.ndarray) -> None:
        """Set positions [m], shape (n_vert, 3); overlaps and rates are found before a frame."""
        given = self._model, self._state, self.work, self.last
        between.set_positions(*given, x, self.velocities())
        self.last = replace(self.last, overlapping=None, rates=None)
        if self.sleeping:
            self.sleeping.wake_all(self.work)

    def reset(self) -> None:
        """Begin anew from the first positions and velocities."""
        for array, first in zip((self._state.x, self._state.v), self.first, strict=True):
            array.assign(first)
        self.last = LastFrame()
        self.spectrum.start_from({})
        warm_start.forget(self.work.warm)
        damping.forget(self.work.damping)
        contact_forces.clear(self.work.forces)
        self.work.contacts.n.zero_()
        self.work.broad_phase.stale.fill_(1)
        if self.sleeping:
            self.sleeping.wake_all(self.work)

    def grow(self) -> bool:
        """Enlarge the buffers that the frame outgrew, and go back to its start; True if any."""
        capacity = enlarged(self.work)
        if capacity is None:
            return False
        forces = self.work.forces
        self.buffers.replace(capacity)
        self._start.go_back(self._state, self.work)
        contact_forces.copy(self.work.forces, forces)
        return True

    def values(self) -> dict[str, np.ndarray]:
        """What a checkpoint needs, beside the state."""
        work = self.work
        groups = {"last": self.last.values(), "start": self.spectrum.starts()}
        groups |= {"warm": warm_start.values(work.warm), "damping": damping.values(work.damping)}
        if self.sleeping:
            groups["sleeping"] = self.sleeping.values(work)
        return checkpoint.ungroup(groups)

    def restore(self, values: dict[str, np.ndarray]) -> None:
        """Take over the ``values`` of another instance with the same scene and settings."""
        self.last = last_frame_of(checkpoint.group(values, "last"))
        self.spectrum.start_from(checkpoint.group(values, "start"))
        sleeping = checkpoint.group(values, "sleeping")
        impulses = checkpoint.group(values, "warm")
        have = self.work.capacity
        pairs = max(have.pairs, len(sleeping.get("pair_key", ())))
        contacts = max(have.contacts, len(impulses["edges"]))
        self.buffers.replace(replace(have, pairs=pairs, contacts=contacts))
        warm_start.restore(self.work.warm, impulses)
        damping.restore(self.work.damping, checkpoint.group(values, "damping"))
        if self.sleeping:
            self.sleeping.restore(sleeping, self.work)

    def _velocities(self) -> wp.array:
        answer = answer_of(self.buffers.response, self.last.overlapping is False)
        return velocities_now(self._model, self._state, self.work, self.last.dt, answer)

    def _run(
        self, omega: float, rate: float, frame: int, in_parts: bool
    ) -> tuple[float, tuple[float, float], str]:
        """Step the frame at the rates [1/s] given.

        Return the step [s] and what ``rates_now`` finds at the end. With ``in_parts`` the frame
        ends as soon as its step no longer fits. It ends early where buffers were too small.
        """
        work = self.work
        if self.sleeping:
            self.sleeping.begin_frame(self._state, work)
        else:
            contact_forces.clear(work.forces)
        given = omega, self.spectrum.stiffest, self.last.n, frame, bool(self._overlapping)
        n = self._step_count.steps(self._state, *given)
        dt = 1.0 / (self.fps * n)
        damping_stages = self._prepare_damping(rate, dt, frame)
        shift_velocities(self._model, self._state, work, work.awake, 0.5 * (self.last.dt - dt))
        work.dt.fill_(dt)
        work.overflow.all.zero_()
        work.surface.was_old.zero_()
        work.broad_phase.bodies.rebuild()
        self._n = n
        after, wrong = NO_RATES, ""
        part = PART if in_parts else n
        for first in range(0, n, part):
            work.steps.fill_(min(part, n - first))
            wp.capture_launch(self.buffers.graph(damping_stages, bool(self._overlapping)))
            after, wrong = rates_now(self._model, self._state, self.spectrum)
            if wrong or not self._fits(dt, rate, after) or enlarged(work) is not None:
                break
        return dt, after, wrong

    def _prepare_damping(self, rate: float, dt: float, frame: int) -> int:
        """Prepare steps ``dt`` [s] for a damping ``rate`` [1/s]; return the stages of each."""
        d = self.work.damping
        if d and stages_for(rate, dt) > MOST:
            name = self._model.labels[self.spectrum.most_damped]
            raise SimulationError(
                f"frame {frame}: motion within body '{name}' decays at up to {rate:.3g} 1/s, "
                f"too fast for a step of {dt:.3g} s: check its damping [s] and its tets"
            )
        if d and self.last.dt not in (0.0, dt):
            scale_contacts(self._model, d, dt / self.last.dt)
        return prepare(d, rate, dt)

    def _begin(self) -> None:
        """Keep what a frame changes."""
        self._start.keep(self._state, self.work)
        self._before = self.last
        self.spectrum.save()
        if self.sleeping:
            self.sleeping.save()

    def _undo(self) -> None:
        """Leave the frame as if it had not begun, wherever it was interrupted."""
        self.last = self._before
        self.spectrum.undo()
        if self.sleeping:
            self.sleeping.undo()
        self.buffers.mend(self._start.n_pair)
        self._start.undo(self._state, self.work)
