"""Worlds within a step: each sweeps and is closed as if the others were not there.

Bodies of different worlds never touch, but share every launch. Each world ends its sweeps where it
has converged itself, and takes part in a stage only where it needs that stage itself.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

# What a world does in the present sweep.
DONE = wp.constant(0)  # nothing
LAST = wp.constant(1)  # its last sweep of the impulses, a plain one
RUNNING = wp.constant(2)

# What a contact asks for in its world.
ANOTHER = wp.constant(1)  # another sweep
TOO_MANY = wp.constant(2)  # the same, with something to be solved and no sweep left

# Looks for overlaps in a step.
NO_LOOK = wp.constant(0)  # a stage of all worlds
FIRST_LOOK = wp.constant(1)  # after the impulses
SECOND_LOOK = wp.constant(2)  # after the first closure, where the first look found an overlap


@wp.struct
class Worlds:
    """What is known of each world in a step."""

    of_vert: wp.array[int]  # (n_vert,) number of the world of each vertex
    apart: wp.array[int]  # (n_world,) 1 where no bodies overlapped when the step began
    negligible: wp.array[float]  # (n_world,) [m] a smaller change in a step affects no contact
    doing: wp.array[int]  # (n_world,) RUNNING, LAST or DONE
    asking: wp.array[int]  # (n_world,) ANOTHER or TOO_MANY where a contact needs another sweep
    unsolved: wp.array[int]  # (n_world,) how often there was no sweep left, since the frame began
    open: wp.array[int]  # (n_world,) the last look that found an overlap to be closed
    old: wp.array[int]  # (n_world,) 1 where an overlap is for the search: it is older than the step
    was_old: wp.array[int]  # (n_world,) 1 where there was one since the frame began
    has_new: wp.array[int]  # (n_world,) 1 where the last pass found a new contact of an edge
    sweep: wp.array[int]  # (1,) number of the present sweep


@wp.func
def ask(worlds: Worlds, world: int, most: int, counts: bool):
    """Ask for another sweep, up to the ``most``; whether it ``counts`` that there is none."""
    if worlds.sweep[0] < most:
        worlds.asking[world] = ANOTHER
    elif counts:
        worlds.asking[world] = TOO_MANY


@wp.kernel
def begin_sweeps(
    # in
    look: int,  # worlds sweep where this look found an overlap
    # in, out
    worlds: Worlds,
    # out, added to
    running: wp.array[int],  # (1,) worlds that sweep
):
    """One thread per world: whether it takes part in the sweeps that begin."""
    w = wp.tid()
    if w == 0:
        worlds.sweep[0] = 1
    worlds.asking[w] = 0
    worlds.doing[w] = DONE
    if worlds.open[w] >= look:
        worlds.doing[w] = RUNNING
        wp.atomic_add(running, 0, 1)


@wp.kernel
def next_sweep(
    # in
    one_more: bool,  # a last sweep follows when no contact asks for another
    # in, out
    worlds: Worlds,
    # out, added to
    running: wp.array[int],  # (1,) worlds that sweep
):
    """One thread per world: what it does in the next sweep."""
    w = wp.tid()
    if w == 0:
        worlds.sweep[0] = worlds.sweep[0] + 1
    was = worlds.doing[w]
    now = was
    if was == LAST:
        now = DONE
    elif was == RUNNING and worlds.asking[w] != ANOTHER:
        now = wp.where(one_more, LAST, DONE)
        if worlds.asking[w] == TOO_MANY:
            worlds.unsolved[w] = worlds.unsolved[w] + 1
    worlds.asking[w] = 0
    worlds.doing[w] = now
    if now == DONE and was != DONE:
        wp.atomic_sub(running, 0, 1)
