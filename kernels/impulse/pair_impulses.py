"""The contact force between two bodies: impulses summed over a frame, in any order.

Threads race for the slots of a hash table and for its sums. Impulses are added as integers, whose
sum does not depend on the order, so the result repeats bit for bit.
"""

import warp as wp

from warp_contact.kernels.impulse.constraint import Impulse
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def add(
    pair: wp.vec2i,
    impulse: wp.vec3,  # [N s] on the first body
    unit: float,  # [N s]
    key: wp.array[wp.int64],
    total: wp.array2d[wp.int64],
) -> bool:
    """Add an impulse to its pair of bodies; False if the table is full."""
    p = impulse
    lo = pair[0]
    hi = pair[1]
    if lo > hi:
        lo = pair[1]
        hi = pair[0]
        p = -p
    name = (wp.int64(lo) << wp.int64(32)) | wp.int64(hi)
    n = key.shape[0]
    slot = int(
        (wp.uint32(lo) * wp.uint32(73856093) ^ wp.uint32(hi) * wp.uint32(19349663)) % wp.uint32(n)
    )
    for _probe in range(n):
        seen = wp.atomic_cas(key, slot, wp.int64(-1), name)
        if seen == wp.int64(-1) or seen == name:
            for k in range(3):
                wp.atomic_add(
                    total, slot, k, wp.int64(wp.round(wp.float64(p[k]) / wp.float64(unit)))
                )
            return True
        slot = (slot + 1) % n
    return False


@wp.kernel
def add_pair_impulses(
    # in
    threads: int,
    unit: float,  # momentum of one count [N s]
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    impulse: wp.array[Impulse],  # (capacity,)
    # in, out
    key: wp.array[wp.int64],  # (n_pair,) lower body * 2^32 + upper body, -1 where free
    total: wp.array2d[wp.int64],  # (n_pair, 3) on the lower body, since the frame began
    needed: wp.array[int],  # (1,) one more than the capacity, where that is too small
):
    """For each contact: add its impulse to its pair, as integers."""
    for c in range(wp.tid(), n_contact[0], threads):
        given = impulse[c]
        p = given.normal * contact[c].normal + given.friction
        if given.normal > 0.0 and not add(contact[c].pair, p, unit, key, total):
            wp.atomic_max(needed, 0, key.shape[0] + 1)
