"""One time step of the default response, read from top to bottom.

``step`` is for bodies that were apart when it began. ``step_overlapping`` is for bodies that may
have overlapped before, such as those that start inside each other. The numbers are those of the
stages in ``kernels/README.md``.
"""

from functools import partial

from warp_contact.data.launch import if_any
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.step import broad_phase, impulse, narrow_phase, surface
from warp_contact.step.motion import drift, finish, finish_free, predict


def step(model: Model, state: State, work: Work, damping_stages: int) -> None:
    """Advance ``state`` in place by ``work.dt``, symplectic Euler.

    No read-back and no allocation, so that a caller may capture it. ``damping_stages`` is
    the number of stages of the damping.
    """
    fly = partial(in_free_flight, model, state, work)
    predict(model, state, work, damping_stages)  # 1
    broad_phase.refresh(model, state.x, work.x, work)  # 2
    if_any(work.broad_phase.any_pair, in_contact, model, state, work, otherwise=fly)


def in_contact(model: Model, state: State, work: Work) -> None:
    """The rest of the step where bodies may touch."""
    narrow_phase.find_entered_vertices(model, state.x, work.x, work)  # 3, 4
    narrow_phase.continue_edges(model, state.x, work)
    impulse.solve(model, state, work)  # 5
    # The impulses may have led other edges across each other. If these were left to the closure,
    # they would keep approaching, and its displacements would add energy.
    drift(model, state, work, work.x)
    narrow_phase.find_entered_edges(model, state.x, work.x, work)  # 3, 4
    impulse.add_edges(model, state, work)
    impulse.solve_again(model, state, work)  # 5
    impulse.finish(work)
    finish(model, state, work)
    surface.close_gaps(model, state, work)  # 8


def in_free_flight(model: Model, state: State, work: Work) -> None:
    """The rest of the step where no bodies can touch."""
    finish_free(model, state, work)
    impulse.forget(work)


def step_overlapping(
    model: Model, state: State, work: Work, damping_stages: int, iterations: int
) -> None:
    """The same where bodies may have overlapped before; ``iterations`` are those of the search."""
    fly = partial(in_free_flight, model, state, work)
    predict(model, state, work, damping_stages)
    broad_phase.refresh(model, state.x, work.x, work)
    if_any(work.broad_phase.any_pair, in_overlap, model, state, work, iterations, otherwise=fly)


def in_overlap(model: Model, state: State, work: Work, iterations: int) -> None:
    """The rest of such a step."""
    narrow_phase.find_inner_vertices(model, state.x, work.x, work)
    narrow_phase.clear_places(work)  # none persists while bodies are moved apart
    impulse.solve(model, state, work)
    drift(model, state, work, work.x)
    narrow_phase.find_inner_edges(model, state.x, work.x, work)
    impulse.add_edges(model, state, work)
    impulse.solve_again(model, state, work)
    impulse.finish(work)
    finish(model, state, work)
    surface.resolve_overlaps(model, state, work, iterations)  # 6, 7, 8
