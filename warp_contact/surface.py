"""Stages 3 and 4: the deformation region, the search for the contact surface, the closure."""

import warp as wp

from warp_contact.forces import internal_forces
from warp_contact.kernels import closure, region, surface
from warp_contact.response import ContactSurface
from warp_contact.types import Model
from warp_contact.work import Work

TOLERANCE = 1e-5  # of an edge: float32 positions are no better in a scene of some hundred edges
BOUND = 0.02  # of an edge: the largest move in a step; more would invert a body started deep inside
PASSES = 4  # of the closure


def leftover(model: Model, x: wp.array, work: Work) -> None:
    """Set ``contacts.left`` at ``x``, and ``found`` where stage 4 has something to do."""
    c = work.contacts
    work.found.zero_()
    wp.launch(
        region.leftover,
        dim=work.capacity.contacts,
        inputs=[TOLERANCE, c.n, c.vert, c.coef, c.normal, c.offset, c.pair, model.body_edge, x],
        outputs=[c.left, work.found],
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
    """Set ``fraction`` and ``contacts.share`` where the pressures balance; ``x`` is moved."""
    c = work.contacts
    around = [c.start, c.entry, c.coef, c.left, work.upper_mean, work.lower_mean, work.s]
    wp.launch(
        surface.begin_balance,
        dim=model.n_vert,
        inputs=[model.tris, model.vs_start, model.vs_tri, x, work.s],
        outputs=[work.area, work.fraction],
    )
    _tractions(model, x, work, work.before)
    for _ in range(response.iterations):
        _displace(model, x, work)
        _tractions(model, x, work, work.now)
        _side_means(work)
        wp.launch(
            surface.solve_balance,
            dim=model.n_vert,
            inputs=[*around, work.before, work.now],
            outputs=[work.fraction],
        )
        _side_means(work)
        wp.launch(surface.meet, dim=model.n_vert, inputs=around, outputs=[work.fraction])
    _side_means(work)
    wp.launch(
        closure.share_by_fraction,
        dim=work.capacity.contacts,
        inputs=[c.n, c.left, work.upper_mean, work.lower_mean],
        outputs=[c.share],
    )
    wp.copy(x, work.x)


def bisect(model: Model, x: wp.array, work: Work, response: ContactSurface) -> None:
    """Move the region to where the printed search leaves it."""
    c = work.contacts
    wp.launch(
        surface.begin_literal,
        dim=model.n_vert,
        inputs=[work.s],
        outputs=[work.area, work.fraction],
    )
    for k in range(response.iterations):
        _displace(model, x, work)
        _tractions(model, x, work, work.now)
        _side_means(work)
        wp.launch(
            surface.bisect,
            dim=model.n_vert,
            inputs=[0.5 ** (k + 2), c.start, c.entry, c.coef, c.left]
            + [work.upper_mean, work.lower_mean, work.s, work.now],
            outputs=[work.fraction],
        )
    _displace(model, x, work)


def close(model: Model, x: wp.array, work: Work) -> None:
    """Move ``x`` until every colliding vertex lies in the plane of its triangle."""
    c = work.contacts
    for _ in range(PASSES):
        wp.launch(
            closure.close_gaps,
            dim=model.n_vert,
            inputs=[BOUND, c.start, c.entry, c.vert, c.coef, c.normal, c.left, c.share]
            + [model.inv_mass, model.vert_body, model.body_edge, work.x],
            outputs=[x],
        )
        leftover(model, x, work)


def share_by_mass(model: Model, work: Work) -> None:
    """Set ``contacts.share`` so that the centre of mass of a contact stays."""
    c = work.contacts
    wp.launch(
        closure.share_by_mass,
        dim=work.capacity.contacts,
        inputs=[c.n, c.vert, c.coef, model.inv_mass],
        outputs=[c.share],
    )


def _displace(model: Model, x: wp.array, work: Work) -> None:
    wp.launch(
        surface.displace, dim=model.n_vert, inputs=[work.x, work.s, work.fraction], outputs=[x]
    )


def _tractions(model: Model, x: wp.array, work: Work, out: wp.array) -> None:
    internal_forces(model, x, work.mask, work.f_tet)
    wp.launch(
        surface.tractions,
        dim=model.n_vert,
        inputs=[model.vt_start, model.vt_corner, work.f_tet, work.s, work.area],
        outputs=[out],
    )


def _side_means(work: Work) -> None:
    c = work.contacts
    wp.launch(
        surface.side_means,
        dim=work.capacity.contacts,
        inputs=[c.n, c.vert, c.coef, work.s, work.before, work.now, work.fraction],
        outputs=[work.upper_mean, work.lower_mean],
    )
