"""One frame of a simulation, repeated where its steps were too long or its buffers too small."""

from dataclasses import replace

import numpy as np
import warp as wp

from warp_contact.data import contact_forces, contacts
from warp_contact.data.damping import MOST
from warp_contact.data.implicit import Shapes
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work, forget
from warp_contact.errors import SimulationError
from warp_contact.frame import between, step_bounds
from warp_contact.frame.buffers import Buffers
from warp_contact.frame.capacity import enlarged
from warp_contact.frame.damping import prepare, stages_for
from warp_contact.frame.diagnosis import finite_vertices, too_damped
from warp_contact.frame.frame_start import FrameStart
from warp_contact.frame.inversion import Inversion
from warp_contact.frame.last_frame import LastFrame, none_yet
from warp_contact.frame.overlap import find_overlaps
from warp_contact.frame.rates import rates_now
from warp_contact.frame.sleeping import Sleeping
from warp_contact.frame.spectrum import Spectrum
from warp_contact.frame.step_count import StepCount
from warp_contact.frame.turns import Turns, segments
from warp_contact.frame.worlds import WorldIds
from warp_contact.frame.wrench import Wrench
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce

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
        wrench: what the user lets act on bodies
        worlds: those that take steps of their own
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
        shapes: Shapes | None,
    ):
        """Allocate what steps need on the current device; without ``shapes`` all are explicit."""
        self.fps, self.wanted, self._model, self._state = fps, wanted, model, state
        self.worlds = WorldIds(model)
        self.last = none_yet(self.worlds.n)
        self.first = state.x.numpy().copy(), state.v.numpy().copy()
        self._step_count = StepCount(model, response, fps, wanted, most, self.worlds, shapes)
        self.spectrum = Spectrum(model, self.worlds, shapes)
        self._inversion = Inversion(model, self.worlds, shapes)
        self._turns = Turns(shapes.explicit if shapes else model, self.worlds, sleeping)
        self.sleeping = Sleeping(model, state, fps, self._turns) if sleeping else None
        self.buffers = Buffers(model, state, response, self._turns.awake, self.worlds, shapes)
        self.wrench = self._step_count.wrench = Wrench(shapes, model)
        self._start, self._cut = FrameStart(state, self.work), False
        self._first_capacity = self.work.capacity

    @property
    def work(self) -> Work:
        """Buffers, with the contacts of the last step."""
        return self.buffers.work

    def step(self, frame: int) -> None:
        """Step frame number ``frame``, again from its start where steps or buffers were too short.

        With nearly flat tets the rates are checked every ``PART`` steps. What ends it early leaves
        all as the last frame did; SimulationError says why no step is possible.
        """
        self._begin()
        try:
            calm = self.last.overlapping == 0  # other worlds have to be searched
            if not self.sleeping or self.sleeping.update(self._state, self.work, calm):
                self._step(frame)
        except BaseException:
            self._undo()
            raise

    def _step(self, frame: int) -> None:
        given = self._model, self._state, self.buffers
        self._overlapping = find_overlaps(*given, self.last.overlapping, self.grow)
        rates = self._find_step(frame)
        old = self._overlapping & (self.work.surface.was_old.numpy() > 0)
        n = np.where(self._turns.idle, self.last.n, self._n)
        self.last = LastFrame(n, self._dt, old.astype(int), rates)
        self.wrench.finish()

    def foresee(self, frame: int) -> int:
        """Steps that frame number ``frame`` will take if none proves too long."""
        return int(self._steps(self._rates(), self.last, frame).max())

    def _rates(self) -> np.ndarray:
        return self.spectrum.rates(self._state.x) if self.last.rates is None else self.last.rates

    def _steps(self, rates: np.ndarray, last: LastFrame, frame: int) -> np.ndarray:
        of_bodies = self.spectrum.of_bodies[0]
        return self._step_count.steps(self._state, of_bodies, rates[0], last, frame)

    def _find_step(self, frame: int) -> np.ndarray:
        """Step the frame until its steps fit; return the last rates [1/s], (2, n_world)."""
        rates, halved = self._rates(), 0
        self._step_count.check(self._state, rates[0], frame)
        self._inversion.begin(self._state)
        in_parts = self._flat()
        for _ in range(ATTEMPTS):
            kept = self.spectrum.memory()
            after, wrong = self._run(rates, frame, in_parts)
            while not (wrong or self._explode(rates, after).any()) and self.grow():
                self.spectrum.remind(kept)
                kept = self.spectrum.memory()
                after, wrong = self._run(rates, frame, in_parts)
            full = enlarged(self.work) is not None  # what explodes never grows
            self._cut = self._cut or full
            # Full buffers tell nothing of a world but that it explodes.
            counts = self._explode(rates, after) | (not full)
            fits = self._fit(rates, after) | ~counts
            flat = in_parts | (counts & (self._flat() | ~np.isfinite(after).all(axis=0)))
            again = flat & ~in_parts
            if not wrong and (fits & ~again).all():
                return after
            self._start.go_back(self._state, self.work)
            if wrong:
                if self.wanted or halved == HALVED or not finite_vertices(self._state).all():
                    raise SimulationError(f"frame {frame}: {wrong} ({self._n.max()} substeps)")
                halved += 1
            self.spectrum.remind(kept, fits & ~again)  # these take the same steps again
            higher = step_bounds.repeated(rates, after, self._dt, in_parts)
            rates, in_parts = np.where(fits, rates, higher), flat
        stiffest = self._model.labels[int(self.spectrum.of_bodies[0].argmax())]
        raise SimulationError(f"frame {frame}: no step is short enough for body '{stiffest}'")

    def _flat(self) -> np.ndarray:
        """Worlds in which a tet was flat at the last check; none where steps are not free."""
        return self.spectrum.flat & (self.wanted is None)

    def _fit(self, rates: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Worlds whose steps, chosen for ``rates`` [1/s], fit the rates ``after`` them."""
        damped = step_bounds.stays_damped(self._dt, rates[1], after[1])
        return damped if self.wanted else damped & step_bounds.stays_stable(self._dt, after[0])

    def _explode(self, rates: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Those that do not fit at all, by ``step_bounds.explodes``."""
        return ~self._fit(rates, after) & step_bounds.explodes(rates, after, self._dt)

    def velocities(self) -> np.ndarray:
        """Velocities [m/s] at the time of the positions, shape (n_vert, 3)."""
        self._start.keep(self._state, self.work)
        found, forces = contacts.copied(self.work.contacts), contact_forces.copied(self.work.forces)
        try:
            now = self._velocities()
            while self.grow():
                now = self._velocities()
        except BaseException:  # an interrupt leaves all as it was
            self._put_back()
            raise
        contacts.copy(self.work.contacts, found)
        contact_forces.copy(self.work.forces, forces)
        return now

    def set_velocities(self, values: np.ndarray, at: np.ndarray, body: int) -> None:
        """Set ``values`` [m/s], shape (k, 3), at vertices ``at`` (k,) of a body."""
        self.buffers.set_steps(self.last.dt)
        if self.sleeping:
            self.sleeping.wake(body)
        between.set_velocities(self._model, self._state, self.work, self.last_dt, values, at)

    def set_positions(self, x: np.ndarray, at: slice) -> None:
        """Set positions [m], shape (n_vert, 3), of vertices ``at``; others stay.

        Before a frame, overlaps are found in worlds of these, and the rates.
        """
        v = self.velocities()
        between.set_positions(self._model, self._state, self.work, self.last_dt, x, v)
        overlapping = self.last.overlapping.copy()
        overlapping[self.worlds.of_vert[at]] = -1
        self.last = replace(self.last, overlapping=overlapping, rates=None)
        if self.sleeping:
            self.sleeping.wake_all(overlapping < 0, self.work)

    def reset(self) -> None:
        """Begin anew from the first positions and velocities."""
        if self._cut:  # where frames end depends on the room that there is
            self.buffers.replace(self._first_capacity)
            self._cut = False
        self._state.x.assign(self.first[0])
        self._state.v.assign(self.first[1])
        self.last = none_yet(self.worlds.n)
        self.wrench.clear()
        self.spectrum.start_from({})
        forget(self.work)
        if self.work.ties:
            self.work.ties.mend(slice(None))
        if self.sleeping:
            self.sleeping.wake_all(self.last.overlapping < 0, self.work)

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

    @property
    def last_dt(self) -> np.ndarray:
        """The last step of each vertex [s], shape (n_vert,)."""
        return self.last.dt[self.worlds.of_vert]

    def _velocities(self) -> np.ndarray:
        self.buffers.set_steps(self.last.dt)
        apart = (self.last.overlapping == 0)[self.worlds.of_vert]
        given = self.work, self.last_dt, self.buffers.response, apart
        return between.velocities(self._model, self._state, *given)

    def _run(self, rates: np.ndarray, frame: int, in_parts: np.ndarray) -> tuple[np.ndarray, str]:
        """Step the frame for the rates given [1/s], shape (2, n_world).

        Return what ``rates_now`` finds at the end, which comes as soon as the steps of worlds
        ``in_parts`` no longer fit, or where buffers were too small.
        """
        work, of_vert, idle = self.work, self.worlds.of_vert, self._turns.idle
        self._turns.let_all(work)
        if self.sleeping:
            self.sleeping.begin_frame(self._state, work)
        else:
            contact_forces.clear(work.forces)
        now = replace(self.last, overlapping=self._overlapping.astype(int))
        self._n = np.where(idle, 0, self._steps(rates, now, frame))
        self._dt = np.where(idle, self.last.dt, 1.0 / (self.fps * np.maximum(self._n, 1)))
        if work.damping and stages_for(rates[1], self._dt) > MOST:
            wrong = too_damped(self._model, self.spectrum.of_bodies[1], self._dt)
            raise SimulationError(f"frame {frame}: {wrong}")
        self.buffers.set_steps(self._dt)
        damping_stages = prepare(work.damping, rates[1], self._dt, of_vert, self.last.dt)
        lag = 0.5 * (self.last.dt - self._dt)[of_vert]
        self.wrench.shift(self._model, self._state, work, lag)
        work.dt.assign(self._dt[of_vert].astype(np.float32))
        self.wrench.begin(self._model, self._state, work)
        self.buffers.begin_frame(self._overlapping)
        graph = self.buffers.graph(damping_stages, bool(self._overlapping.any()))
        for count, begun, looked in segments(self._n, in_parts, PART):
            self._turns.begin(begun, self._dt, work, self._start)
            work.steps.fill_(count)
            wp.capture_launch(graph)
            full = enlarged(work) is not None
            if full or looked is None or looked.any():
                given = self._state, self.spectrum, None if full else looked
                after, wrong = rates_now(self._model, *given)
                if not (full or wrong):
                    after = self._inversion.held_against(after, self._state, self._dt)
                if full or wrong or not self._fit(rates, after).all():
                    break
        self._turns.end(work, self._start)
        return after, wrong

    def _begin(self) -> None:
        """Keep what a frame changes."""
        self._start.keep(self._state, self.work)
        self._before = self.last
        self._memory = self.spectrum.memory()
        if self.sleeping:
            self.sleeping.save()

    def _undo(self) -> None:
        """Leave the frame as if it had not begun, wherever it was interrupted."""
        self.last = self._before
        self.spectrum.remind(self._memory)
        self.wrench.undo()
        self._put_back()
        if self.sleeping:
            self.sleeping.undo()

    def _put_back(self) -> None:
        self.buffers.mend(self._start.n_pair)
        self._turns.let_all(self.work)
        self._start.undo(self._state, self.work)
