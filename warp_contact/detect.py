"""Stage 1: near bodies, vertices inside other bodies, surface edges across other bodies."""

import warp as wp

from warp_contact.kernels import bounds, crossing, hashing
from warp_contact.types import Model
from warp_contact.work import Work, launch_body_boxes, launch_triangle_boxes


def near_bodies(model: Model, x0: wp.array, x1: wp.array, work: Work) -> None:
    """Set ``near``, the bodies that may touch from ``x0`` to ``x1``, and the triangle Bvh."""
    launch_body_boxes(model, x0, x1, work.lower, work.upper)
    work.bodies.refit()
    wp.launch(
        bounds.near_bodies,
        dim=model.n_body,
        inputs=[model.cell, work.bodies.id, model.body_world, work.lower, work.upper],
        outputs=[work.n_near, work.near, work.contacts.needed[3:4]],
    )
    launch_triangle_boxes(model, x0, x1, work.n_near, work.tri_lower, work.tri_upper)
    work.surface.refit()
    wp.launch(
        bounds.prune_near,
        dim=model.n_body,
        inputs=[work.surface.id, model.tris, work.lower, work.upper, x1],
        outputs=[work.n_near, work.near],
    )


def find_inside(model: Model, x: wp.array, work: Work) -> None:
    """Set ``inside``: the bodies that hold each vertex."""
    slots = work.capacity.slots
    work.inside.fill_(-1)
    work.cell_start.zero_()
    wp.launch(
        hashing.count_cells,
        dim=model.n_vert,
        inputs=[model.cell, model.vert_body, model.body_world, work.n_near, work.near]
        + [work.lower, work.upper, x],
        outputs=[work.key, work.cell_start],
    )
    wp.utils.array_scan(work.cell_start, work.cell_start, inclusive=True)
    wp.launch(
        hashing.fill_cells,
        dim=model.n_vert,
        inputs=[work.key],
        outputs=[work.cell_start, work.cell_vert],
    )
    wp.launch(
        hashing.find_inside,
        dim=model.n_tet,
        inputs=[model.cell, slots, model.tets, model.vert_body, model.body_world]
        + [work.n_near, work.near, work.lower, work.upper, work.cell_start, work.cell_vert, x],
        outputs=[work.inside, work.contacts.needed[1:2]],
    )


def list_hits(model: Model, x: wp.array, work: Work) -> None:
    """Set ``hit_start`` and the hits, sorted by vertex and body."""
    slots = work.capacity.slots
    planes = [model.on_surface, model.plane_n, model.plane_h, x]
    wp.launch(
        hashing.count_hits,
        dim=model.n_vert,
        inputs=[slots, *planes],
        outputs=[work.inside, work.hit_start],
    )
    wp.utils.array_scan(work.hit_start, work.hit_start, inclusive=False)
    wp.launch(
        hashing.list_hits,
        dim=model.n_vert,
        inputs=[slots, model.n_body, *planes, work.inside, work.hit_start],
        outputs=[work.hit_vert, work.hit_body, work.hit_layer],
    )


def find_crossings(
    model: Model, x0: wp.array, x: wp.array, work: Work, fresh: bool, again: bool
) -> None:
    """Set ``edge_start`` and ``edge_body``: edges that cross a body with both ends outside."""
    wp.launch(
        crossing.count_crossings,
        dim=model.n_edge,
        inputs=[work.capacity.edge_slots, fresh, again, work.surface.id, model.tris, model.edges]
        + [model.vert_body, model.body_edge, work.n_near, work.near, work.lower, work.upper, x0, x],
        outputs=[work.edge_close, work.edge_start, work.edge_body, work.contacts.needed[2:3]],
    )
    wp.utils.array_scan(work.edge_start, work.edge_start, inclusive=False)
