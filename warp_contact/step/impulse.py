"""Stage 5: impulses between the bodies; penalty and predicted forces, to compare with."""

import warp as wp

from warp_contact.data.launch import launch_over
from warp_contact.data.model import Model
from warp_contact.data.work import Work
from warp_contact.kernels.impulse import (
    impulse,
    pair_impulses,
    penalty,
    persistent,
    predicted,
    warm_start,
)
from warp_contact.step.response import Penalty

SWEEPS = 48  # of the impulses, at most; few clusters of contacts last so long
TOLERANCE = 1e-5  # of an edge: an approach in one step that is left to the closure
QUIET = 0.1  # of the tolerance, at the shortest edge: a change that nobody needs to know of


def begin(model: Model, x0: wp.array, work: Work, first: wp.array) -> None:
    """Set what the sweeps need; contacts from ``first``, shape (1,), on have no impulse yet."""
    c = work.contacts
    launch_over(
        impulse.begin_contacts,
        work.capacity.contacts,
        inputs=[model.friction, first, c.n, c.vert, c.coef, c.normal, c.offset, c.pair, c.start]
        + [model.inv_mass, model.body_edge, work.dt, x0],
        outputs=[c.weight, c.coupled, c.closing, c.open, c.turn, c.mu, c.ramp]
        + [c.lam, c.slip, c.ahead],
    )


def recall(model: Model, v: wp.array, work: Work) -> None:
    """Start the contacts, and ``v``, from the impulses of the last step."""
    c = work.contacts
    recall_edges(work)
    launch_over(
        warm_start.recall,
        work.capacity.contacts,
        inputs=[work.n_hit, c.n, c.vert, c.coef, c.normal, c.pair, c.weight]
        + [c.open, c.turn, c.mu, c.ramp, work.warm.partner, work.warm.kept],
        outputs=[c.lam, c.slip, c.ahead, c.part],
    )
    _apply(model, v, work)


def recall_edges(work: Work) -> None:
    """Let the contacts of edges go on from the impulses that they have."""
    c = work.contacts
    launch_over(
        persistent.recall,
        work.capacity.contacts,
        inputs=[work.n_hit, c.n, c.normal, c.weight, c.mu, work.source, work.crossing],
        outputs=[c.lam, c.slip, c.ahead],
    )


def keep(work: Work) -> None:
    """Keep the impulses of the vertices for the next step."""
    c = work.contacts
    work.warm.partner.fill_(-1)
    launch_over(
        warm_start.keep,
        work.capacity.contacts,
        inputs=[work.n_hit, c.vert, c.pair, c.lam, c.slip],
        outputs=[work.warm.partner, work.warm.kept],
    )


def keep_edges(work: Work) -> None:
    """Keep the impulses of the edges, and their contacts for the next step."""
    c = work.contacts
    launch_over(
        persistent.keep,
        work.capacity.contacts,
        inputs=[work.n_hit, c.n, work.source, c.lam, c.slip],
        outputs=[work.crossing, work.warm.held, work.warm.n_held],
    )


def forget(work: Work) -> None:
    """There are no contacts in this step, and no impulses to start the next one from."""
    work.n_hit.zero_()
    work.n_crossing.zero_()
    work.contacts.n.zero_()
    work.warm.partner.fill_(-1)
    forget_edges(work)


def forget_edges(work: Work) -> None:
    """There are no contacts of edges for the next step to go on with."""
    work.warm.n_held.zero_()


def exchange(model: Model, v: wp.array, work: Work) -> None:
    """Change ``v`` by normal impulses and friction until no contact approaches."""
    c = work.contacts

    def sweep(first: bool = False, last: bool = False) -> None:
        next_sweep(work, first)
        launch_over(
            impulse.solve_contacts,
            work.capacity.contacts,
            inputs=[TOLERANCE, _little(work), SWEEPS, work.dt, model.body_edge, c.pair, work.done]
            + [c.n, c.vert, c.coef, c.normal, c.coupled, c.closing, c.open, c.turn]
            + [c.mu, c.ramp, work.stirred, v, last],
            outputs=[c.lam, c.slip, c.ahead, c.busy, c.part, work.served, work.again],
        )
        _apply(model, v, work, swept=True)

    sweep(first=True)
    wp.capture_while(work.again, sweep)
    sweep(last=True)


def next_sweep(work: Work, first: bool) -> None:
    """Count a sweep over the contacts in ``done`` and clear ``again``."""
    wp.launch(impulse.next_sweep, dim=1, inputs=[first], outputs=[work.again, work.done])


def push(model: Model, v: wp.array, work: Work, response: Penalty) -> None:
    """Change ``v`` by the penalty forces at the depths found."""
    c = work.contacts
    launch_over(
        penalty.penalty_impulses,
        work.capacity.contacts,
        inputs=[response.stiffness, response.damping, model.friction, work.dt]
        + [c.n, c.vert, c.coef, c.normal, c.depth, c.coupled, c.open, c.turn, v],
        outputs=[c.lam, c.slip, c.part],
    )
    _apply(model, v, work)


def push_apart(model: Model, x: wp.array, v: wp.array, work: Work) -> None:
    """Change ``v`` by the forces that close the gaps at the predicted positions ``x``."""
    c = work.contacts
    launch_over(
        predicted.predicted_impulses,
        work.capacity.contacts,
        inputs=[model.n_body, model.friction, work.dt]
        + [c.n, c.vert, c.coef, c.normal, c.offset, c.pair, c.weight, c.coupled]
        + [c.open, c.turn, x, v],
        outputs=[c.lam, c.slip, c.part],
    )
    _apply(model, v, work)


def record(work: Work, unit: float) -> None:
    """Add the impulses of all contacts to their pairs of bodies, in counts of ``unit`` [N s]."""
    c = work.contacts
    launch_over(
        pair_impulses.add_pair_impulses,
        work.capacity.contacts,
        inputs=[unit, c.n, c.pair, c.normal, c.lam, c.slip],
        outputs=[work.pair_key, work.pair_total, c.needed[1:2]],
    )


def _apply(model: Model, v: wp.array, work: Work, swept: bool = False) -> None:
    """Add the parts of the contacts to ``v``; ``swept``: only what the last sweep changed."""
    c = work.contacts
    launch_over(
        impulse.apply_impulses,
        model.n_vert,
        inputs=[swept, _little(work), work.dt, work.done]
        + [c.n_touched, c.touched, c.start, c.entry, c.part, model.inv_mass, work.served],
        outputs=[v, work.impulse, work.stirred],
    )


def _little(work: Work) -> float:
    return QUIET * TOLERANCE * work.candidates.edge
