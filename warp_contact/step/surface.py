"""The end of a step: residual overlaps are moved onto a common surface.

These displacements do not become velocities.
"""

import math

import warp as wp

from warp_contact.data.launch import if_any, launch_over
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.switches import on
from warp_contact.data.work import Work
from warp_contact.kernels.lengths import OLD_OVERLAP
from warp_contact.kernels.surface import closure
from warp_contact.kernels.surface.residual import keep_contacts
from warp_contact.kernels.worlds import FIRST_LOOK, SECOND_LOOK
from warp_contact.step import coupled, residual, search, sweeps, ties
from warp_contact.step.contact_graph import add_parts
from warp_contact.step.detection import detect
from warp_contact.step.motion import explicit_part


def close_gaps(model: Model, state: State, work: Work, iterations: int) -> None:
    """Search the surface between bodies that overlapped before the step, then close the rest.

    ``iterations`` are those of the search; 0 where nothing can have overlapped before.
    """
    residual.add_gaps(model, state.x, work)
    if on("strays"):
        residual.add_strays(model, state.x, state.v, work)
    if not work.ties:
        return if_any(work.surface.any_open, _close_twice, model, state, work, iterations)
    if_any(work.surface.any_open, _close, model, state, work, iterations)
    ties.look_again(work)
    _close_again(model, state, work)


def _close_twice(model: Model, state: State, work: Work, iterations: int) -> None:
    _close(model, state, work, iterations)
    _close_again(model, state, work)


def _close(model: Model, state: State, work: Work, iterations: int) -> None:
    if iterations and on("search"):
        if_any(work.surface.any_old, _search, model, state, work, iterations)
    # Where bodies were apart, no overlap is older than the step: one that seems so has a wrong
    # plane, and the second look may find a better one.
    first = OLD_OVERLAP if on("old planes") else math.inf
    close(model, state, work, FIRST_LOOK, _searched(), first)


def _close_again(model: Model, state: State, work: Work) -> None:
    # Vertices may now be at other triangles than before, and edges may cross that the narrow phase
    # could not see.
    if on("second look"):
        _keep_contacts(work)
        detect(model, state.x, state.x, work)
    residual.find_gaps_left(model, state.x, work)
    if_any(work.surface.any_open, close, model, state, work, SECOND_LOOK, _searched())


def _searched() -> float:
    """How old an overlap is for the search, in edges."""
    return OLD_OVERLAP if on("search") else math.inf


def _keep_contacts(work: Work) -> None:
    """Let the contacts with the impulses of the step be read after it, in place of others."""
    c = work.contacts
    outputs = [c.kept.n, c.kept.record, c.kept.impulse]
    launch_over(keep_contacts, work.capacity.contacts, [c.n, c.record, c.impulse], outputs)


def _search(model: Model, state: State, work: Work, iterations: int) -> None:
    search.balance(model, state.x, work, iterations)
    if on("search spin"):
        search.keep_spin(model, state, work)


def close(
    model: Model,
    state: State,
    work: Work,
    look: int = FIRST_LOOK,
    before: float = math.inf,
    apart: float = math.inf,
) -> None:
    """Move ``state.x`` until no contact overlaps, or as far as one call may move it.

    Only in worlds where the ``look`` found an overlap. Vertices then lie in the planes of their
    triangles, edges on what they touch. ``state.v`` changes only by the torque that keeps the
    angular momentum. Contacts that overlapped by more than some edges when the step began are left
    out: ``before`` in worlds where bodies may have overlapped then, ``apart`` in the others.
    """
    if not on("closure"):
        return
    c, s = work.contacts, work.surface
    launch_over(
        closure.begin_closure,
        work.capacity.contacts,
        inputs=[wp.vec3(before, apart, search.SEARCH_BOUND), c.n, c.record, c.constraint]
        + [work.dt, s.residual, work.worlds, search.soft(work)],
        outputs=[s.slack, s.push],
    )
    if work.implicit:
        coupled.close(model, state, work, look)
    else:
        sweeps.repeat(work, look, False, _sweep, model, state.x, work)
    if on("closure torque") and explicit_part(model, work):
        launch_over(
            closure.torques,
            work.capacity.contacts,
            inputs=[c.n, c.record, c.constraint, s.push, state.v],
            outputs=[c.part],
        )
        add_parts(model, state.v, work, work.worlds.open)


def _sweep(model: Model, x: wp.array, work: Work) -> None:
    c, s = work.contacts, work.surface
    launch_over(
        closure.solve_gaps,
        work.capacity.contacts,
        inputs=[c.n, c.record, c.constraint, s.slack, x],
        outputs=[s.push, c.part, work.worlds],
    )
    add_parts(model, x, work, work.worlds.doing)
