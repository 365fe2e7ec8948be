"""The search for the contact surface, for overlaps older than the step: eqs. (1) and (2)."""

import math

import warp as wp

from warp_contact.data.launch import launch_over
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.lengths import SEARCH_BOUND
from warp_contact.kernels.mobility import Mobility
from warp_contact.kernels.surface import region, search, spin
from warp_contact.step.forces import internal_forces


def soft(work: Work) -> Mobility:
    """The mobilities of what deforms: rigid bodies have none, as the surface lies on their side."""
    return work.implicit.soft if work.implicit else work.mobility


def begin(model: Model, x: wp.array, work: Work, moves: wp.array) -> None:
    """Set the displacement vectors, the touching tets, and ``work.x`` before the search.

    Only in worlds where ``moves``, shape (n_world,), is not 0.
    """
    c, s = work.contacts, work.surface
    wp.copy(work.x, x)
    wp.launch(
        region.displacement_vectors,
        dim=model.n_vert,
        inputs=[c.graph, c.record, s.residual, soft(work), work.worlds, moves],
        outputs=[s.s],
    )
    wp.launch(region.touching_tets, dim=model.n_tet, inputs=[model.tets, s.s], outputs=[s.mask])


def balance(model: Model, x: wp.array, work: Work, iterations: int) -> None:
    """Move the region to where the pressures of both sides balance, by ``SEARCH_BOUND`` at most."""
    s = work.surface
    begin(model, x, work, s.old)
    wp.launch(
        search.begin_balance,
        dim=model.n_vert,
        inputs=[model.tris, model.vs_start, model.vs_tri, x, s.s],
        outputs=[s.area, s.fraction],
    )
    _tractions(model, x, work, s.at_start)
    _displace(model, x, work)
    _tractions(model, x, work, s.at_trial)
    wp.launch(
        search.stiffnesses,
        dim=model.n_vert,
        inputs=[s.s, s.at_start, s.at_trial],
        outputs=[s.stiffness],
    )
    _correct(model, work, s.at_start, anew=True)
    for _ in range(iterations - 2):
        _displace(model, x, work)
        _tractions(model, x, work, s.at_trial)
        _correct(model, work, s.at_trial, anew=False)
    _displace(model, x, work, SEARCH_BOUND)


def keep_spin(model: Model, state: State, work: Work) -> None:
    """Give each body the angular momentum back that its displacements have changed."""
    s = work.surface
    wp.launch(
        spin.lost_spin,
        dim=model.n_body,
        inputs=[model.body_vert, model.mass, work.mobility.inv_mass, work.x, state.x, state.v],
        outputs=[s.centre, s.spin],
    )
    wp.launch(
        spin.add_spin,
        dim=model.n_vert,
        inputs=[model.vert_body, s.centre, s.spin, state.x],
        outputs=[state.v],
    )


def bisect(model: Model, x: wp.array, work: Work, iterations: int) -> None:
    """Move the region by the search as the paper prints it."""
    s = work.surface
    begin(model, x, work, s.open)
    wp.launch(
        search.begin_literal,
        dim=model.n_vert,
        inputs=[s.s],
        outputs=[s.area, s.fraction],
    )
    for k in range(iterations):
        _displace(model, x, work)
        _tractions(model, x, work, s.at_trial)
        _side_means(work, s.at_trial)
        wp.launch(
            search.bisect,
            dim=model.n_vert,
            inputs=[0.5 ** (k + 2), *_around(work), s.at_trial],
            outputs=[s.fraction],
        )
    _displace(model, x, work)


def _correct(model: Model, work: Work, traction: wp.array, anew: bool) -> None:
    """Move both fractions towards equal pressures at the tractions found, and let them meet."""
    s = work.surface
    _side_means(work, traction)
    wp.launch(
        search.correct_balance,
        dim=model.n_vert,
        inputs=[anew, *_around(work), traction, s.stiffness],
        outputs=[s.fraction],
    )
    _side_means(work, traction)
    wp.launch(search.meet, dim=model.n_vert, inputs=_around(work), outputs=[s.fraction])


def _around(work: Work) -> list:
    """What a vertex needs to find the other side."""
    c, s = work.contacts, work.surface
    return [c.graph, c.record, s.residual, s.upper_mean, s.lower_mean, s.s]


def _displace(model: Model, x: wp.array, work: Work, bound: float = math.inf) -> None:
    s = work.surface
    wp.launch(
        search.displace,
        dim=model.n_vert,
        inputs=[bound, model.vert_body, model.body_edge, work.x, s.s, s.fraction],
        outputs=[x],
    )


def _tractions(model: Model, x: wp.array, work: Work, out: wp.array) -> None:
    s = work.surface
    internal_forces(model, x, s.mask, work.f_tet)
    wp.launch(
        search.tractions,
        dim=model.n_vert,
        inputs=[model.vt_start, model.vt_corner, work.f_tet, s.s, s.area],
        outputs=[out],
    )


def _side_means(work: Work, traction: wp.array) -> None:
    c, s = work.contacts, work.surface
    launch_over(
        search.side_means,
        work.capacity.contacts,
        inputs=[c.n, c.record, s.s, traction, s.stiffness, s.fraction],
        outputs=[s.upper_mean, s.lower_mean],
    )
