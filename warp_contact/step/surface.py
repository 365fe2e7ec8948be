"""Stages 3 and 4: the deformation region, the search for the contact surface, the closure."""

import math

import warp as wp

from warp_contact.data.contacts import Contacts
from warp_contact.data.launch import launch_over
from warp_contact.data.model import Model
from warp_contact.data.work import Work
from warp_contact.kernels.narrow_phase import contact_graph
from warp_contact.kernels.surface import closure, region, search
from warp_contact.step.forces import internal_forces
from warp_contact.step.impulse import next_sweep
from warp_contact.step.response import ContactSurface

TOLERANCE = 1e-4  # of an edge: less overlap is left to the resting gap of the impulses
DEEP = 1e-3  # of an edge below the resting gap: an overlap at the start of a step, worth a search
BOUND = 0.02  # of an edge: the largest move in a step; more would invert a body started deep inside
PASSES = 128  # of the closure, at most; corners that meet need more than 32


def leftover(
    model: Model, x: wp.array, work: Work, strays: bool = False, more: bool = False
) -> None:
    """Set ``contacts.left`` at ``x``, and ``found``: what stage 4 has to do.

    ``strays``: also where a vertex left the triangle of its contact, or lies below it. ``more``: in
    addition to what is ``found`` already.
    """
    c = work.contacts
    if not more:
        work.found.zero_()
    launch_over(
        closure.leftover,
        work.capacity.contacts,
        inputs=[TOLERANCE, DEEP, strays, c.n, c.vert, c.coef, c.normal, c.offset, c.pair]
        + [model.body_edge, c.closing, work.dt, x],
        outputs=[c.left, work.found, work.deep_found],
    )


def begin_search(model: Model, x: wp.array, work: Work) -> None:
    """Set the displacement vectors ``s``, the touching tets and ``x`` before stage 4."""
    c = work.contacts
    wp.copy(work.x, x)
    wp.launch(
        region.displacement_vectors,
        dim=model.n_vert,
        inputs=[c.start, c.entry, c.coef, c.normal, c.left, model.inv_mass],
        outputs=[work.s],
    )
    wp.launch(
        region.touching_tets,
        dim=model.n_tet,
        inputs=[model.tets, work.s],
        outputs=[work.mask],
    )


def balance(model: Model, x: wp.array, work: Work, response: ContactSurface) -> None:
    """Set ``fraction`` where the pressures balance and move the region there, by ``BOUND``."""
    c = work.contacts
    around = [c.start, c.entry, c.coef, c.left, work.upper_mean, work.lower_mean, work.s]
    wp.launch(
        search.begin_balance,
        dim=model.n_vert,
        inputs=[model.tris, model.vs_start, model.vs_tri, x, work.s],
        outputs=[work.area, work.fraction],
    )
    _tractions(model, x, work, work.before)
    _displace(model, x, work)
    _tractions(model, x, work, work.now)
    wp.launch(
        search.stiffnesses,
        dim=model.n_vert,
        inputs=[work.s, work.before, work.now],
        outputs=[work.stiffness],
    )
    for k in range(response.iterations - 1):
        if k > 0:
            _displace(model, x, work)
            _tractions(model, x, work, work.now)
        traction = work.now if k > 0 else work.before
        _side_means(work, traction)
        wp.launch(
            search.correct_balance,
            dim=model.n_vert,
            inputs=[k == 0, *around, traction, work.stiffness],
            outputs=[work.fraction],
        )
        _side_means(work, traction)
        wp.launch(search.meet, dim=model.n_vert, inputs=around, outputs=[work.fraction])
    _displace(model, x, work, BOUND)


def bisect(model: Model, x: wp.array, work: Work, response: ContactSurface) -> None:
    """Move the region to where the printed search leaves it."""
    c = work.contacts
    wp.launch(
        search.begin_literal,
        dim=model.n_vert,
        inputs=[work.s],
        outputs=[work.area, work.fraction],
    )
    for k in range(response.iterations):
        _displace(model, x, work)
        _tractions(model, x, work, work.now)
        _side_means(work, work.now)
        wp.launch(
            search.bisect,
            dim=model.n_vert,
            inputs=[0.5 ** (k + 2), c.start, c.entry, c.coef, c.left]
            + [work.upper_mean, work.lower_mean, work.s, work.now],
            outputs=[work.fraction],
        )
    _displace(model, x, work)


def close(model: Model, x: wp.array, v: wp.array, work: Work, deep: float) -> None:
    """Move ``x`` until every colliding vertex lies in the plane of its triangle.

    ``v`` changes only by what keeps the angular momentum. Contacts that overlapped by more than
    ``deep``, of an edge, when the step began are left out.
    """
    c = work.contacts
    launch_over(
        closure.begin_closure,
        work.capacity.contacts,
        inputs=[BOUND, deep, c.n, c.pair, model.body_edge] + [c.closing, work.dt, c.left],
        outputs=[c.slack, c.push],
    )

    def sweep(first: bool = False) -> None:
        next_sweep(work, first)
        launch_over(
            closure.solve_gaps,
            work.capacity.contacts,
            inputs=[TOLERANCE, model.n_body, PASSES, c.n, c.vert, c.coef, c.normal, c.offset]
            + [c.pair, c.weight, model.body_edge, c.slack, x, work.done],
            outputs=[c.push, c.part, work.again],
        )
        _add_parts(model, c, x)

    sweep(first=True)
    wp.capture_while(work.again, sweep)
    launch_over(
        closure.couples,
        work.capacity.contacts,
        inputs=[c.n, c.vert, c.coef, c.normal, c.turn, c.push, v],
        outputs=[c.part],
    )
    _add_parts(model, c, v)


def _add_parts(model: Model, c: Contacts, y: wp.array) -> None:
    launch_over(
        contact_graph.add_parts,
        model.n_vert,
        inputs=[c.n_touched, c.touched, c.start, c.entry, c.part, model.inv_mass],
        outputs=[y],
    )


def _displace(model: Model, x: wp.array, work: Work, bound: float = math.inf) -> None:
    wp.launch(
        search.displace,
        dim=model.n_vert,
        inputs=[bound, model.vert_body, model.body_edge, work.x, work.s, work.fraction],
        outputs=[x],
    )


def _tractions(model: Model, x: wp.array, work: Work, out: wp.array) -> None:
    internal_forces(model, x, work.mask, work.f_tet)
    wp.launch(
        search.tractions,
        dim=model.n_vert,
        inputs=[model.vt_start, model.vt_corner, work.f_tet, work.s, work.area],
        outputs=[out],
    )


def _side_means(work: Work, traction: wp.array) -> None:
    c = work.contacts
    launch_over(
        search.side_means,
        work.capacity.contacts,
        inputs=[c.n, c.vert, c.coef, work.s, traction, work.stiffness, work.fraction],
        outputs=[work.upper_mean, work.lower_mean],
    )
