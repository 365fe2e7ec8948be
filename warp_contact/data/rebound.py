"""What a step needs where bodies have a coefficient of restitution."""

from dataclasses import dataclass, replace

import warp as wp

from warp_contact.data.contacts import Contacts
from warp_contact.kernels.impulse.constraint import Constraint, Impulse
from warp_contact.kernels.impulse.strike import Strike
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.worlds import Worlds


@dataclass
class Rebound:
    """Allocated only where some coefficient is above zero.

    Attributes:
        before: velocities at the start of the step [m/s], shape (n_vert,)
        free: those without the contacts of the step [m/s], shape (n_vert,)
        strike: what is known of contacts that strike, shape (capacity,)
        any: 1 where one strikes, shape (1,)
        most, given: energies that may come back to each body, and that did, shape (n_body,)
        contacts: those of the step as they are at its end, with their impulses there
        worlds: of the step; those with a strike are open
    """

    before: wp.array[wp.vec3]
    free: wp.array[wp.vec3]
    strike: wp.array[Strike]
    any: wp.array[int]
    most: wp.array[wp.int64]
    given: wp.array[wp.int64]
    contacts: Contacts
    worlds: Worlds


def allocate(n_vert: int, n_body: int, contacts: Contacts, worlds: Worlds) -> Rebound:
    """Allocate for the contacts and worlds of a step, whose other arrays are shared."""
    n = len(contacts.record)
    own = Worlds()
    for name in Worlds.vars:  # type: ignore[attr-defined]
        setattr(own, name, getattr(worlds, name))
    own.open = wp.zeros_like(worlds.open)
    return Rebound(
        before=wp.zeros(n_vert, dtype=wp.vec3),
        free=wp.zeros(n_vert, dtype=wp.vec3),
        strike=wp.zeros(n, dtype=Strike),
        any=wp.zeros(1, dtype=int),
        most=wp.zeros(n_body, dtype=wp.int64),
        given=wp.zeros(n_body, dtype=wp.int64),
        contacts=replace(
            contacts,
            record=wp.zeros(n, dtype=Contact),
            constraint=wp.zeros(n, dtype=Constraint),
            impulse=wp.zeros(n, dtype=Impulse),
        ),
        worlds=own,
    )
