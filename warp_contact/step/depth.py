"""Stage 2: depth, direction and contact triangle of every hit and crossing."""

import warp as wp

from warp_contact.data.launch import launch_over
from warp_contact.data.model import Model
from warp_contact.data.work import Work
from warp_contact.kernels.narrow_phase import contact_graph, depth, edges, vertex_contact


def hit_depths(model: Model, x: wp.array, work: Work) -> None:
    """Set ``hit_depth``, ``hit_dir`` and ``hit_layer``: the border, then layer by layer.

    Once after each ``detect.find_hits``, which sets ``layer`` and ``pending``.
    """
    hits = [work.candidates.verts.start, work.hit_at, work.hit_vert, work.hit_body]
    launch_over(
        depth.border_depth,
        work.capacity.contacts,
        inputs=[model.n_body, work.surface.id, model.tris]
        + [model.vs_start, model.vs_tri, model.vn_start, model.vn_vert, x, *hits],
        outputs=[work.hit_depth, work.hit_dir, work.hit_layer, work.pending],
    )

    def fill_layer() -> None:
        wp.launch(depth.begin_layer, dim=1, inputs=[], outputs=[work.layer, work.pending])
        launch_over(
            depth.propagate,
            work.capacity.contacts,
            inputs=[work.layer, model.vn_start, model.vn_vert, x, *hits],
            outputs=[work.hit_depth, work.hit_dir, work.hit_layer, work.pending],
        )

    wp.capture_while(work.pending, fill_layer)


def vertex_contacts(model: Model, x0: wp.array, x: wp.array, work: Work, fresh: bool) -> None:
    """Set the contact records of the hits at ``x`` in a step from ``x0``.

    ``fresh``: no overlap is older than the step.
    """
    launch_over(
        vertex_contact.vertex_contacts,
        work.capacity.contacts,
        inputs=[model.n_body, fresh, work.surface.id, model.tris, model.body_edge]
        + [model.vert_body, model.on_surface, model.vs_start, model.vs_tri]
        + [model.plane_n, model.plane_h, x0, x]
        + [work.hit_at, work.hit_vert, work.hit_body]
        + [work.hit_layer, work.hit_depth, work.hit_dir],
        outputs=_records(work),
    )
    _count(work, work.none, work.none)


def edge_contacts(model: Model, x0: wp.array, work: Work) -> None:
    """Append the contact records of the crossings found in a step from ``x0``."""
    c = work.candidates.edges
    launch_over(
        edges.edge_contacts,
        work.capacity.edges,
        inputs=[c.n, c.pair, model.edges, model.vert_body, work.n_hit]
        + [work.crossing_at, work.place, work.crossing, x0],
        outputs=[*_records(work), work.source],
    )
    _count(work, work.n_crossing, work.n_place)


def contacts_by_vertex(model: Model, work: Work) -> None:
    """Set ``contacts.start``, ``entry`` and ``touched``."""
    c = work.contacts
    m = work.capacity.contacts
    c.start.zero_()
    outputs = [c.n_touched, c.start]
    launch_over(contact_graph.count_entries, m, inputs=[c.n, c.vert, c.coef], outputs=outputs)
    wp.utils.array_scan(c.start, c.start, inclusive=True)
    launch_over(
        contact_graph.fill_entries,
        m,
        inputs=[c.n, c.vert, c.coef],
        outputs=[c.start, c.entry],
    )
    outputs = [c.entry, c.touched, c.n_touched]
    launch_over(contact_graph.sort_entries, model.n_vert, inputs=[c.start], outputs=outputs)


def _records(work: Work) -> list[wp.array]:
    c = work.contacts
    return [c.vert, c.coef, c.normal, c.depth, c.offset, c.pair]


def _count(work: Work, crossings: wp.array, places: wp.array) -> None:
    wp.launch(
        contact_graph.total_contacts,
        dim=1,
        inputs=[work.n_hit, crossings, places, work.capacity.contacts],
        outputs=[work.contacts.n, work.contacts.needed[0:1]],
    )
