"""Contacts of the last step as Warp arrays: nothing of them is copied to the host."""

import numpy as np
import warp as wp

from warp_contact.data.scan import allocate, scan
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.narrow_phase.contact import vec5, vec5i
from warp_contact.kernels.output import contacts
from warp_contact.kernels.output.contacts import ContactArrays


class ContactRows:
    """Arrays for as many contacts as a step has room for.

    Attributes:
        capacity: how many these are
        arrays: the contacts of the last call of ``fill``
    """

    def __init__(self, capacity: int, n_vert: int):
        """Allocate on the current device."""
        self.capacity = capacity
        self.arrays = ContactArrays()
        self.arrays.n = wp.zeros(1, dtype=int)
        kinds = {"bodies": wp.vec2i, "vertices": vec5i, "weights": vec5}
        kinds |= dict.fromkeys(("gap", "normal_impulse", "normal_force"), float)
        of_vectors = "point", "normal", "friction_impulse", "friction_force", "slip"
        kinds |= dict.fromkeys(of_vectors, wp.vec3)
        for name, dtype in kinds.items():
            setattr(self.arrays, name, wp.zeros(capacity, dtype=dtype))
        self._before = wp.zeros(capacity + 1, dtype=int)
        self._scratch = allocate(capacity + 1)
        self._dt = wp.zeros(n_vert, dtype=float)

    def fill(self, state: State, work: Work, dt: np.ndarray) -> ContactArrays:
        """Contacts at the present positions; ``dt`` are the last steps [s], shape (n_vert,)."""
        c = work.contacts
        self._dt.assign(dt.astype(np.float32))
        wp.launch(
            contacts.mark_contacts,
            dim=self.capacity + 1,
            inputs=[c.n, c.record, c.kept.n, c.kept.record],
            outputs=[self._before],
        )
        scan(self._before, self._scratch, inclusive=False)
        wp.launch(
            contacts.write_contacts,
            dim=self.capacity,
            inputs=[c.record, c.impulse, c.kept.n, c.kept.record, c.kept.impulse]
            + [self._before, self._dt, state.x, state.v],
            outputs=[self.arrays],
        )
        return self.arrays
