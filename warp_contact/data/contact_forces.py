"""What contact did in a frame so far: its impulses, and how often it was not solved."""

from dataclasses import dataclass

import warp as wp

from warp_contact.kernels.impulse.pair_impulses import COLUMNS


@dataclass
class ContactForces:
    """Impulses summed since the first step of the frame.

    Attributes:
        unit: momentum of one count in ``pair_total`` [N s]
        received: impulse received by each vertex [N s], shape (n_vert,)
        pair_key: the two bodies of a pair with a contact force, -1 where free, shape (pairs,)
        pair_total: its sums, in units, see pair_impulses.py, shape (pairs, COLUMNS)
        unsolved: solves that ran out of sweeps, shape (n_world,)
    """

    unit: float
    received: wp.array[wp.vec3]
    pair_key: wp.array[wp.int64]
    pair_total: wp.array2d[wp.int64]
    unsolved: wp.array[int]


def copied(forces: ContactForces) -> ContactForces:
    """The same in arrays of its own."""
    arrays = forces.received, forces.pair_key, forces.pair_total, forces.unsolved
    return ContactForces(forces.unit, *(wp.clone(array) for array in arrays))


def copy(to: ContactForces, of: ContactForces) -> None:
    """Overwrite one with another; there is room for its pairs."""
    n = of.pair_key.shape[0]
    wp.copy(to.received, of.received)
    wp.copy(to.pair_key[:n], of.pair_key)
    wp.copy(to.pair_total[:n], of.pair_total)
    wp.copy(to.unsolved, of.unsolved)


def clear(forces: ContactForces) -> None:
    """Forget all."""
    forces.received.zero_()
    forces.pair_key.fill_(-1)
    forces.pair_total.zero_()
    forces.unsolved.zero_()


def allocate(n_vert: int, n_pair: int, n_world: int, unit: float) -> ContactForces:
    """Allocate without any impulse."""
    return ContactForces(
        unit=unit,
        received=wp.zeros(n_vert, dtype=wp.vec3),
        pair_key=wp.full(n_pair, -1, dtype=wp.int64),
        pair_total=wp.zeros((n_pair, int(COLUMNS)), dtype=wp.int64),
        unsolved=wp.zeros(n_world, dtype=int),
    )
