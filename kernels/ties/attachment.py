"""Attachments as a whole: their forces, where they break, and whom they keep awake or apart.

    F = |sum of the impulses of its ties in a step| / h         breaks above its limit        [N]

Bodies that are attached to each other make no contacts, as long as one of their attachments holds.
"""

import warp as wp

from warp_contact.kernels.broad_phase.pairs import PairList
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.ties.tie import HELD, Ties, across, direction, gap

wp.set_module_options(OPTIONS)

NEVER = wp.constant(1.0e30)  # a way that no body goes [m]
OPEN = wp.constant(1.0e-4)  # of an edge: a hard tie that is left wider is not solved


@wp.struct
class Attachments:
    """The attachments, each with its ties."""

    body: wp.array[wp.vec2i]  # (n_attachment,) both bodies, -1 for the world
    first: wp.array[int]  # (n_attachment + 1,) first of each in ``tie``
    tie: wp.array[int]  # (n_tie,)
    limit: wp.array[float]  # (n_attachment,) [N] the force that breaks it, infinite without
    broken: wp.array[int]  # (n_attachment,) 1 where it is
    impulse: wp.array[wp.vec3d]  # (n_attachment,) [N s] on the first body, since the frame began


@wp.struct
class Partners:
    """Which bodies each body is attached to."""

    start: wp.array[int]  # (n_body + 1,) first entry of each
    body: wp.array[int]  # (2 n_attachment,) the other one, -1 for the world
    by: wp.array[int]  # (2 n_attachment,) the attachment
    broken: wp.array[int]  # (n_attachment,) 1 where it is


@wp.func
def hang_together(partners: Partners, b: int, c: int) -> bool:
    """Whether an attachment between two bodies holds."""
    if partners.start.shape[0] == 0:
        return False  # nothing is attached
    for k in range(partners.start[b], partners.start[b + 1]):
        if partners.body[k] == c and partners.broken[partners.by[k]] == 0:
            return True
    return False


@wp.kernel
def record(
    # in
    dt: wp.array[float],  # (n_vert,) [s]
    body_edge: wp.array[float],  # (n_body,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m] at the end of the step
    world: wp.array[int],  # (n_vert,) number of the world of each vertex
    ties: Ties,
    # in, out
    of: Attachments,
    # out
    stale: wp.array[int],  # (1,) 1 where one breaks: its bodies may touch
    # out, added to
    unsolved: wp.array[int],  # (n_world,) how often one was not solved
):
    """One thread per attachment: add its impulse of a step, and break it if that is too large."""
    a = wp.tid()
    p = wp.vec3d()
    open = bool(False)
    for k in range(of.first[a], of.first[a + 1]):
        t = of.tie[k]
        p += ties.held[t]
        if ties.state[t] == HELD and ties.compliance[t] == 0.0:
            c = across(gap(t, ties.now[t], ties.at[t], ties, x), direction(t, ties, x))
            if wp.length(c) > wp.float64(OPEN * body_edge[of.body[a][0]]):
                open = True
    of.impulse[a] = of.impulse[a] + p
    i = ties.vert[of.tie[of.first[a]]][0]
    h = dt[i]
    if open:
        wp.atomic_add(unsolved, world[i], 1)
    if of.broken[a] == 0 and wp.length(p) > wp.float64(of.limit[a] * h):
        of.broken[a] = 1
        stale[0] = 1


@wp.func
def is_awake(a: int, of: Attachments, awake: wp.array[int]) -> bool:
    """Whether one of its bodies is."""
    if awake[of.body[a][0]] == 1:
        return True
    b = of.body[a][1]
    if b < 0:
        return False
    return awake[b] == 1


@wp.kernel
def begin_frame(
    # in
    awake: wp.array[int],  # (n_body,)
    # in, out
    of: Attachments,
):
    """One thread per attachment: forget its impulse, but of bodies asleep."""
    a = wp.tid()
    if is_awake(a, of, awake):
        of.impulse[a] = wp.vec3d()


@wp.kernel
def wake(
    # in
    of: Attachments,
    mobile: wp.array[int],  # (n_body,) 1 where a vertex is not fixed
    # in, out
    awake: wp.array[int],  # (n_body,)
    # out, added to
    again: wp.array[int],  # (1,) 1 when another body woke up
):
    """One thread per attachment: wake both bodies if one is awake."""
    a = wp.tid()
    b = of.body[a][0]
    c = of.body[a][1]
    if of.broken[a] == 1 or c < 0:
        return
    if awake[b] == 1 and awake[c] == 0 and mobile[c] == 1:
        awake[c] = 1
        again[0] = 1
    if awake[c] == 1 and awake[b] == 0 and mobile[b] == 1:
        awake[b] = 1
        again[0] = 1


@wp.kernel
def keep_apart(
    # in
    threads: int,
    vert_body: wp.array[int],  # (n_vert,)
    edges: wp.array[wp.vec4i],  # (n_edge,) where the owners are edges, else empty
    pairs: PairList,
    partners: Partners,
    # out
    clear_until: wp.array[float],  # (capacity,) [m] travelled by both, before they meet
):
    """For each pair: it does not meet where its bodies are attached to each other."""
    for c in range(wp.tid(), wp.min(pairs.n[0], clear_until.shape[0]), threads):
        i = pairs.pair[c][0]
        if edges.shape[0] > 0:
            i = edges[i][0]
        if hang_together(partners, vert_body[i], pairs.pair[c][1]):
            clear_until[c] = NEVER
