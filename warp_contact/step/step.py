"""One time step of the default response, read from top to bottom.

The numbers are those of the stages in ``kernels/README.md``. In some worlds bodies may have
overlapped before the step, such as those that start inside each other: there contacts are found in
another way, and overlaps older than the step are searched.
"""

from functools import partial

from warp_contact.data.launch import if_any
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.step import broad_phase, impulse, narrow_phase, surface
from warp_contact.step.motion import drift, finish, finish_free, predict
from warp_contact.step.settle import settle


def step(model: Model, state: State, work: Work, damping_stages: int, iterations: int) -> None:
    """Advance ``state`` in place by ``work.dt``, symplectic Euler.

    No read-back and no allocation, so that a caller may capture it. ``damping_stages`` is
    the number of stages of the damping, ``iterations`` that of force evaluations of the search, 0
    where bodies were apart in all worlds.
    """
    fly = partial(in_free_flight, model, state, work)
    work.contacts.kept.n.fill_(-1)
    predict(model, state, work, damping_stages)  # 1
    broad_phase.refresh(model, state.x, work.x, work)  # 2
    if_any(work.broad_phase.any_pair, in_contact, model, state, work, iterations, otherwise=fly)


def in_contact(model: Model, state: State, work: Work, iterations: int) -> None:
    """The rest of the step where bodies may touch."""
    narrow_phase.find_vertices(model, state.x, work.x, work)  # 3, 4
    narrow_phase.continue_edges(model, state.x, work)
    impulse.solve(model, state, work)  # 5
    if work.implicit and work.implicit.any_deforming:
        settle(model, state, work)
    # The impulses may have led other edges across each other. If these were left to the closure,
    # they would keep approaching, and its displacements would add energy.
    drift(model, state, work, work.x)
    narrow_phase.find_edges(model, state.x, work.x, work)  # 3, 4
    impulse.add_edges(model, state, work)
    impulse.solve_again(model, state, work)  # 5
    impulse.finish(state.x, work)
    finish(model, state, work)
    surface.close_gaps(model, state, work, iterations)  # 6, 7, 8


def in_free_flight(model: Model, state: State, work: Work) -> None:
    """The rest of the step where no bodies can touch."""
    impulse.forget(work)
    finish_free(model, state, work)
