"""The contact force between two bodies: impulses summed over a frame, in any order.

Threads race for the slots of a hash table and for its sums. Impulses are added as integers, whose
sum does not depend on the order, so the result repeats bit for bit. Beside the impulse are summed
the part of friction, the size of the normal impulses, and this size times the place of the contact:
their quotient is the point at which the normal force acts.
"""

import warp as wp

from warp_contact.kernels.impulse.constraint import Impulse
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

COLUMNS = wp.constant(10)  # impulse and friction, 3 each, size, size times place, 3
vec10 = wp.types.vector(length=10, dtype=float)


@wp.func
def add(
    pair: wp.vec2i,
    sums: vec10,  # of one contact; impulses [N s] on the first body
    unit: float,  # [N s]
    key: wp.array[wp.int64],
    total: wp.array2d[wp.int64],
) -> bool:
    """Add an impulse to its pair of bodies; False if the table is full."""
    sign = float(1.0)
    lo = pair[0]
    hi = pair[1]
    if lo > hi:
        lo = pair[1]
        hi = pair[0]
        sign = -1.0
    name = (wp.int64(lo) << wp.int64(32)) | wp.int64(hi)
    n = key.shape[0]
    slot = int(
        (wp.uint32(lo) * wp.uint32(73856093) ^ wp.uint32(hi) * wp.uint32(19349663)) % wp.uint32(n)
    )
    for _probe in range(n):
        seen = wp.atomic_cas(key, slot, wp.int64(-1), name)
        if seen == wp.int64(-1) or seen == name:
            for k in range(COLUMNS):
                p = wp.float64(sums[k])
                if k < 6:
                    p = wp.float64(sign * sums[k])
                wp.atomic_add(total, slot, k, wp.int64(wp.round(p / wp.float64(unit))))
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
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    key: wp.array[wp.int64],  # (n_pair,) lower body * 2^32 + upper body, -1 where free
    total: wp.array2d[wp.int64],  # (n_pair, COLUMNS) on the lower body, since the frame began
    needed: wp.array[int],  # (1,) one more than the capacity, where that is too small
):
    """For each contact: add its impulse to its pair, as integers."""
    for c in range(wp.tid(), n_contact[0], threads):
        given = impulse[c]
        at = contact[c]
        if given.normal <= 0.0:
            continue
        place = at.coef[0] * x[at.vert[0]] + at.coef[1] * x[at.vert[1]]
        sums = vec10()
        for k in range(3):
            sums[k] = given.normal * at.normal[k] + given.friction[k]
            sums[3 + k] = given.friction[k]
            sums[7 + k] = given.normal * place[k]
        sums[6] = given.normal
        if not add(at.pair, sums, unit, key, total):
            wp.atomic_max(needed, 0, key.shape[0] + 1)
