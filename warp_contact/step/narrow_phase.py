"""Narrow phase: which vertices lie inside other bodies, and which edges cross them.

There are two ways to find a contact. In worlds where bodies were apart when the step began, every
overlap has arisen within the step, and the side by which a vertex came in tells the direction. In
those where they may have overlapped before, only the depth does: see ``apart`` in
``kernels/worlds.py``.
"""

from functools import partial

import warp as wp

from warp_contact.data.launch import if_any, launch_over
from warp_contact.data.model import Model
from warp_contact.data.scan import scan
from warp_contact.data.switches import on
from warp_contact.data.work import Work
from warp_contact.kernels.narrow_phase import edges, persistent, vertex_contact, vertices
from warp_contact.step.broad_phase import track
from warp_contact.step.contact_graph import count_contacts
from warp_contact.step.depth import find_depths


def find_vertices(
    model: Model, x0: wp.array, x: wp.array, work: Work, near_plane: float = 0.0
) -> None:
    """Contacts of the vertices inside other bodies at ``x``, in a step from ``x0``.

    A vertex above a plane by less than ``near_plane`` edges of its body has one too.
    """

    def find() -> None:
        _find_penetrations(model, x0, x, work, near_plane)
        if_any(work.contacts.n_vertex, make_contacts, otherwise=work.contacts.n.zero_)

    def make_contacts() -> None:
        find_depths(model, x, work)
        launch_over(
            vertex_contact.vertex_contacts,
            work.capacity.contacts,
            inputs=[work.worlds, work.mesh, x0, x, work.contacts.n_vertex, n.penetration],
            outputs=[work.contacts.record],
        )
        count_contacts(work, n.none, n.none)

    def find_none() -> None:
        work.contacts.n_vertex.zero_()
        work.contacts.n.zero_()

    n = work.narrow_phase
    if_any(work.broad_phase.verts.n, find, otherwise=find_none)


def find_edges(model: Model, x0: wp.array, x: wp.array, work: Work) -> None:
    """Contacts of the edges across other bodies at ``x``, beside the persistent ones."""

    def find() -> None:
        b, travel = work.broad_phase, work.broad_phase.edges.travel
        track(model, x, travel, work)
        launch_over(
            edges.find_crossings,
            work.capacity.edges,
            inputs=[work.mesh, b.edges.list, b.skin, travel.recent, travel.travelled, x0, x],
            outputs=[b.edges.clear_until, b.apart, n.place, n.found, n.crossing_at]
            + [n.n_place, n.n_new, work.worlds],
        )
        scan(n.crossing_at, work.scan, inclusive=False)

    def find_none() -> None:
        n.n_crossing.zero_()
        n.new.zero_()

    n = work.narrow_phase
    if on("edges"):
        if_any(work.broad_phase.edges.n, find, otherwise=find_none)
    else:
        find_none()


def clear_places(work: Work) -> None:
    """Begin without contacts of edges."""
    work.narrow_phase.place.fill_(-1)
    work.narrow_phase.n_place.zero_()


def continue_edges(model: Model, x0: wp.array, work: Work) -> None:
    """Begin with the persistent contacts of edges, if any; the step begins at ``x0``."""
    none = partial(clear_places, work)
    if not on("persistent edges"):
        return none()
    if_any(work.warm.n_edge, _continue_edges, model, x0, work, otherwise=none)


def append_edge_contacts(model: Model, x0: wp.array, work: Work) -> None:
    """List the contacts of edges found so far, behind those of the vertices."""
    n, c = work.narrow_phase, work.contacts
    launch_over(
        edges.edge_contacts,
        work.capacity.edges,
        inputs=[work.mesh, work.broad_phase.edges.list, c.n_vertex, n.crossing_at]
        + [n.place, n.found, x0],
        outputs=[c.record, n.source],
    )
    count_contacts(work, n.n_crossing, n.n_place)


def _find_penetrations(
    model: Model, x0: wp.array, x: wp.array, work: Work, near_plane: float
) -> None:
    """Set the vertices inside other bodies at ``x``, or gone through, by vertex and body."""
    b, n = work.broad_phase, work.narrow_phase
    track(model, x, b.verts.travel, work)
    launch_over(
        vertices.find_penetrations,
        work.capacity.verts,
        inputs=[work.mesh, b.verts.list, b.verts.travel.travelled, near_plane]
        + [model.body_thickness, x0, x],
        outputs=[b.verts.clear_until, n.inside_at],
    )
    scan(n.inside_at, work.scan, inclusive=False)
    launch_over(
        vertices.list_penetrations,
        work.capacity.verts,
        inputs=[model.n_body, b.verts.list, n.inside_at, b.verts.clear_until],
        outputs=[n.penetration, n.layer, n.pending],
    )


def _continue_edges(model: Model, x0: wp.array, work: Work) -> None:
    n = work.narrow_phase
    n.place.fill_(-1)
    n.crossing_at.zero_()
    wp.copy(n.n_place, work.warm.n_edge)
    launch_over(
        persistent.continue_contacts,
        work.capacity.contacts,
        inputs=[work.warm.n_edge, work.warm.edges, work.broad_phase.edges.list]
        + [work.mesh, work.worlds, x0],
        outputs=[n.crossing_at, n.place, n.found],
    )
    scan(n.crossing_at, work.scan, inclusive=False)
    if_any(n.n_crossing, append_edge_contacts, model, x0, work)
