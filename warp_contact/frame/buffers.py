"""The buffers of the steps, and the graphs that are captured on them."""

import numpy as np
import warp as wp

from warp_contact.data import damping, ties
from warp_contact.data.implicit import Shapes, set_blocks
from warp_contact.data.model import Model
from warp_contact.data.overflow import Capacity
from warp_contact.data.state import Awake, State
from warp_contact.data.work import Work, allocate_work, let_rebound
from warp_contact.frame.implicit_shapes import Inverses
from warp_contact.frame.integrator import refuse_restitution
from warp_contact.frame.worlds import WorldIds
from warp_contact.step.loop import step_of, take_steps
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce
from warp_contact.step.ties import begin_frame

NEIGHBOURS = 8  # initial capacity: pairs with a contact force for each body
IMPULSE_UNIT = 1e-13  # momentum of one count of the recorded impulses, for all mobile mass at 1 m/s


class Buffers:
    """What a step fills, replaced by larger ones where a frame has outgrown it.

    Attributes:
        work: buffers, with the contacts of the last step; missing only while they are replaced
        response: how bodies respond to contact
        unit: resolution of the recorded contact impulses [N s]
        shapes: of bodies that take implicit steps; None where none does
    """

    def __init__(
        self,
        model: Model,
        state: State,
        response: ContactSurface | Penalty | PredictedForce,
        awake: Awake | None,
        worlds: WorldIds,
        shapes: Shapes | None,
    ):
        """Allocate on the current device; ``awake`` is what moves, None for everything."""
        self._worlds, self.shapes = worlds, shapes
        self._inverses = Inverses(model, shapes) if shapes else None
        self._steps = np.zeros(0)  # of the bodies, that the mobilities are for [s]
        self._ties = ties.allocate(model, shapes.too_large) if shapes else None
        self._model, self._state, self._awake = model, state, awake
        self.response = response
        inv_mass = model.inv_mass.numpy()
        mobile = float(model.mass.numpy()[inv_mass > 0.0].sum(dtype=np.float64))
        self.unit = IMPULSE_UNIT * (mobile if mobile > 0.0 else 1.0)
        self._graphs: dict[tuple[int, bool, bool], wp.Graph] = {}
        pairs = max(Capacity.pairs, NEIGHBOURS * model.n_body)
        self.work: Work = self._allocate(Capacity(pairs=pairs))

    def set_steps(self, dt: np.ndarray) -> None:
        """Let mobilities be those of steps ``dt`` [s] of the worlds, where steps are implicit."""
        if self._inverses and dt.all():
            steps = dt[self._worlds.of_body]
            if not np.array_equal(steps, self._steps):
                self._steps = np.zeros(0)  # an interrupt leaves none
                self._set_blocks(self.work, steps)
                self._steps = steps

    def _set_blocks(self, work: Work, steps: np.ndarray) -> None:
        lengths, which = np.unique(steps, return_inverse=True)
        found = [self._inverses.blocks(float(h)) for h in lengths]
        blocks, norms = (np.concatenate(part) for part in zip(*found, strict=True))
        first = which * len(found[0][1])  # of the blocks of all shapes for the step of each body
        if set_blocks(work.implicit, self.shapes, steps, first, blocks, norms):
            self._graphs.clear()

    def begin_frame(self, overlapping: np.ndarray) -> None:
        """Forget what is of the last frame; in worlds that are ``overlapping``, a mask, some do."""
        work = self.work
        work.overflow.all.zero_()
        work.surface.was_old.zero_()
        work.worlds.apart.assign((~overlapping).astype(np.int32))
        work.broad_phase.bodies.rebuild()
        if work.ties:
            begin_frame(work)

    def use(self, work: Work) -> None:
        """Continue with other buffers."""
        self.work = work
        work.forces.unit = self.unit
        self._graphs.clear()

    def replace(self, capacity: Capacity) -> None:
        """Free the buffers, then allocate: old and new ones at once would be the peak of memory."""
        before = self.work.capacity
        self._graphs.clear()
        del self.work
        try:
            self.work = self._allocate(capacity)
        except RuntimeError:  # there is no memory for it
            self.work = self._allocate(before)
            raise

    def let_rebound(self) -> None:
        """Let there be restitution from now on; raises ValueError where steps take none."""
        refuse_restitution(self.response, self.shapes is not None)
        if not self.work.rebound:
            let_rebound(self.work)
            self._graphs.clear()

    def mend(self, n_pair: int) -> None:
        """Allocate anew, for ``n_pair`` pairs, where an interrupt came while they were replaced."""
        if not hasattr(self, "work"):
            self.work = self._allocate(Capacity(pairs=n_pair))

    def graph(self, damping_stages: int, overlapping: bool) -> wp.Graph:
        """The captured steps of a frame, with so many stages of damping."""
        driven = bool(self.work.ties and self.work.ties.driven)
        key = damping_stages, overlapping, driven
        if key not in self._graphs:
            one = step_of(self.response, overlapping)
            with wp.ScopedCapture() as capture:
                take_steps(self._model, self._state, self.work, damping_stages, one)
            self._graphs[key] = capture.graph
        return self._graphs[key]

    def _allocate(self, capacity: Capacity) -> Work:
        given = self._awake, self.unit, self.shapes, self._ties
        work = allocate_work(self._model, self._state, capacity, *given)
        if self._model.restitution.numpy().any():
            let_rebound(work)
        if len(self._steps):
            self._set_blocks(work, self._steps)
        explicit = self.shapes.explicit if self.shapes else self._model
        damping.divide(work.damping, explicit, self._worlds.of_vert, self._worlds.n)
        return work
