"""Stage 1, in every step: vertices inside other bodies, surface edges across other bodies."""

import warp as wp

from warp_contact.data.launch import launch_over
from warp_contact.data.model import Model
from warp_contact.data.work import Work
from warp_contact.kernels.impulse import persistent
from warp_contact.kernels.narrow_phase import edges, vertices
from warp_contact.step import broad_phase


def find_hits(model: Model, x: wp.array, work: Work) -> None:
    """Set the hits at ``x``, sorted by vertex and body, ``hit_at``, ``layer`` and ``pending``."""
    broad_phase.track(model, x, work)
    c = work.candidates.verts
    launch_over(
        vertices.find_hits,
        work.capacity.verts,
        inputs=[c.n, c.pair, c.items, c.item, model.n_body, model.tets]
        + [model.vert_body, model.body_edge, model.plane_n, model.plane_h, work.candidates.way, x],
        outputs=[c.wake, work.hit_at],
    )
    wp.utils.array_scan(work.hit_at, work.hit_at, inclusive=False)
    launch_over(
        vertices.list_hits,
        work.capacity.verts,
        inputs=[model.n_body, c.n, c.pair, work.hit_at],
        outputs=[work.hit_vert, work.hit_body, work.hit_layer, work.layer, work.pending],
    )


def find_crossings(
    model: Model, x0: wp.array, x: wp.array, work: Work, fresh: bool, hold: bool = False
) -> None:
    """Set ``crossing_at``, ``place``, ``crossing`` and ``n_new``: edges across a body at ``x``.

    The step begins at ``x0``; ``fresh``: no overlap is older than that. ``hold``: add to what is
    there.
    """
    broad_phase.track(model, x, work, hold)
    c = work.candidates.edges
    launch_over(
        edges.find_crossings,
        work.capacity.edges,
        inputs=[hold, fresh, work.candidates.skin, c.n, c.pair, c.items, c.item, work.surface.id]
        + [model.tris, model.edges, model.vert_body, model.body_edge]
        + [work.candidates.pace, work.candidates.way, x0, x],
        outputs=[c.wake, work.place, work.crossing, work.crossing_at] + [work.n_place, work.n_new],
    )
    wp.utils.array_scan(work.crossing_at, work.crossing_at, inclusive=False)


def hold_crossings(model: Model, x0: wp.array, work: Work) -> None:
    """Set ``crossing_at``, ``place`` and ``crossing``: contacts of edges that go on."""
    c = work.candidates.edges
    work.place.fill_(-1)
    work.crossing_at.zero_()
    launch_over(
        persistent.hold,
        work.capacity.contacts,
        inputs=[work.candidates.edge, work.warm.n_held, work.warm.held, c.start, c.pair]
        + [model.edges, model.tris, x0],
        outputs=[work.crossing_at, work.place, work.crossing, work.n_place],
    )
    wp.utils.array_scan(work.crossing_at, work.crossing_at, inclusive=False)
