"""What a user reads of contacts: each of them, forces between bodies and on them, fields."""

import numpy as np

from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.exclusive import exclusively
from warp_contact.frame.stepper import Stepper
from warp_contact.measure import contact_data
from warp_contact.measure.contact_arrays import ContactArrays, ContactRows
from warp_contact.measure.contact_fields import contact_fields
from warp_contact.measure.measure import Meter
from warp_contact.scene.scene import Body
from warp_contact.scene.selection import Bodies


class ContactData:
    """The contacts of the last step and the contact forces of the last frame."""

    fps: float
    frame: int
    model: Model
    state: State
    device: object
    _bodies: Bodies
    _stepper: Stepper
    _meter: Meter
    _rows: ContactRows | None = None

    def contacts(self) -> contact_data.Contacts:
        """Contacts of the last step, at the present positions: points, normals, forces, slip.

        A force is that of one step; ``forces`` has the mean of the frame. Bodies asleep have none.
        """
        s = self._stepper
        return contact_data.contacts(self.state, s.work, s.last_dt)

    def contact_arrays(self) -> ContactArrays:
        """The same as Warp arrays on the device, of which nothing is copied to the host.

        Only the first ``n[0]`` entries of each are contacts. They are overwritten by the next call,
        and out of date after the next frame.
        """
        s = self._stepper
        with exclusively(self.device):
            capacity = len(s.work.contacts.record)
            if self._rows is None or self._rows.capacity != capacity:
                self._rows = ContactRows(capacity, self.model.n_vert)
            return self._rows.fill(self.state, s.work, s.last_dt)

    def forces(self) -> contact_data.PairForces:
        """Mean contact force of the last frame on the first body of each pair that touched.

        The pairs are named as in ``measure().forces``, in the order in which bodies were added,
        planes last; each has ``normal`` and ``friction`` [N] and the ``point`` of the first [m].
        One that is asked for in the other order has its forces turned round; ``get(pair)`` is None
        where a pair did not touch, and a label that is none of the scene's a KeyError.
        """
        return contact_data.pair_forces(self._meter.names, self._stepper.work, self._duration)

    def force_on(self, body: Body | int | str, vertices=None) -> np.ndarray:
        """Mean contact force of the last frame on a body, or on some of its vertices [N], (3,).

        Args:
            body: the body
            vertices: mask or ids within the body; None for all

        Raises:
            ValueError: there is no such body or vertex
        """
        every = np.arange(self.model.n_vert)
        part, chosen = self._bodies.choose(every, body, vertices)
        return contact_data.force_on(part[chosen], self._stepper.work, self._duration)

    def contact_fields(self) -> dict[str, np.ndarray]:
        """Per vertex: ``force`` [N] and ``pressure`` [Pa], means over the last frame, and more.

        Beside these ``penetration`` [m] and ``partner``, a body's index, n_body + p for plane p, -1
        for none: of the contacts of the last step, as ``contacts()`` has them, at the predicted
        positions, for a penalty at those at its start. Persistent contacts of edges have no
        penetration. Shapes (n_vert,), of the force (n_vert, 3).
        """
        return contact_fields(self.model, self.state.x, self._stepper.work, 1.0 / self.fps)

    @property
    def _duration(self) -> float:
        """Time over which contact forces were summed [s]."""
        return 1.0 / self.fps if self.frame else 0.0
