"""Stage 1, now and then: near bodies, and the vertices and edges that may come to touch them."""

import warp as wp

from warp_contact.data.broad_phase import Pairs
from warp_contact.data.launch import launch_over
from warp_contact.data.model import Model
from warp_contact.data.work import Work, launch_body_boxes, launch_triangle_boxes
from warp_contact.kernels.broad_phase import edges, hashing, margins, near
from warp_contact.kernels.broad_phase import pairs as kernels


def refresh(model: Model, x0: wp.array, x1: wp.array, work: Work) -> None:
    """Find the candidates at ``x0`` unless those at hand hold for a step from ``x0`` to ``x1``."""
    c = work.candidates
    wp.launch(
        margins.moved,
        dim=model.n_vert,
        inputs=[model.vert_body, c.free, c.skin, c.x, x0, x1],
        outputs=[c.stale],
    )

    def find() -> None:
        wp.copy(c.x, x0)
        wp.copy(c.last, x0)
        c.way.zero_()
        c.verts.wake.fill_(-1.0)
        c.edges.wake.fill_(-1.0)
        _choose_skins(model, x1, work)
        if model.n_plane:
            list_pairs()
        else:
            wp.capture_if(c.some, list_pairs, none)

    def list_pairs() -> None:
        _find_parts(model, work)
        _find_tets(model, work)
        _find_tris(model, work)
        wp.launch(kernels.any_pairs, dim=1, inputs=[c.verts.n, c.edges.n], outputs=[c.some])

    def none() -> None:
        for pairs in (c.verts, c.edges):
            pairs.n.zero_()
            pairs.start.zero_()
            pairs.item_start.zero_()

    wp.capture_if(c.stale, find)


def track(model: Model, x: wp.array, work: Work, hold: bool = False) -> None:
    """Let the bodies go on to ``x``, where candidates are looked at.

    ``n_new`` is 0 then, and ``n_place``, unless what has a place is to ``hold`` it.
    """
    c = work.candidates
    _move(model, x, work)
    outputs = [c.motion, c.pace, c.way, work.n_place, work.n_new]
    wp.launch(margins.go_on, dim=model.n_body, inputs=[hold], outputs=outputs)


def _move(model: Model, x: wp.array, work: Work) -> None:
    """Add to ``motion`` what is new at ``x``."""
    c = work.candidates
    chunks = -(-model.n_vert // int(margins.CHUNK))
    inputs = [model.vert_body, x]
    wp.launch(margins.track, dim=chunks, inputs=inputs, outputs=[c.last, c.motion])


def _choose_skins(model: Model, x1: wp.array, work: Work) -> None:
    """Set ``free`` and ``skin`` for a step to ``x1``, ``near`` and the boxes of the bodies."""
    c = work.candidates
    c.motion.zero_()
    c.fastest.zero_()
    _move(model, x1, work)
    c.total.zero_()
    wp.launch(
        margins.find_fastest,
        dim=model.n_body,
        inputs=[c.edge, c.motion],
        outputs=[c.fastest, c.total],
    )
    inputs = [c.edge, c.fastest, c.motion]
    wp.launch(margins.widest_skins, dim=model.n_body, inputs=inputs, outputs=[c.skin])
    _find_near(model, work)
    wp.launch(
        margins.choose_skins,
        dim=model.n_body,
        inputs=[c.edge, c.total, c.motion, work.near],
        outputs=[c.free, c.skin, c.stale, c.some],
    )
    _find_near(model, work)


def _find_near(model: Model, work: Work) -> None:
    """Set the bodies that may touch, within their skins, and their Bvh."""
    c, of = work.candidates, work.near
    launch_body_boxes(model, c.x, c.skin, work.lower, work.upper)
    work.bodies.refit()
    wp.launch(
        near.near_bodies,
        dim=model.n_body,
        inputs=[model.cell, c.skin, work.bodies.id, model.body_world, model.body_vert]
        + [work.awake.bodies]
        + [work.lower, work.upper, c.x],
        outputs=[of.n_near, of.near, of.slab, of.end, c.some],
    )


def _find_parts(model: Model, work: Work) -> None:
    """Set which parts of near bodies may touch, and the Bvh over the triangles."""
    c, of = work.candidates, work.near
    launch_triangle_boxes(model, c.x, c.skin, of.n_near, work.tri_lower, work.tri_upper)
    work.surface.refit()
    c.n_found.zero_()
    wp.launch(
        near.near_parts,
        dim=of.near.shape,
        inputs=[c.skin, work.surface.id, model.body_vert, model.tris, of, c.x],
        outputs=[of.vert_lower, of.vert_upper, of.tri_lower, of.tri_upper, of.tris]
        + [c.near_tri, c.n_found],
    )
    wp.launch(
        near.fits,
        dim=1,
        inputs=[work.capacity.near],
        outputs=[c.n_found, work.contacts.needed[6:7]],
    )


def _find_tets(model: Model, work: Work) -> None:
    """Set the pairs of vertices and bodies, and their tets."""
    c = work.candidates
    of = work.near
    work.cell_start.zero_()
    wp.launch(
        hashing.count_cells,
        dim=model.n_vert,
        inputs=[model.cell, c.skin, model.vert_body, of, c.x],
        outputs=[work.key, work.cell_start],
    )
    wp.utils.array_scan(work.cell_start, work.cell_start, inclusive=True)
    wp.launch(
        hashing.fill_cells,
        dim=model.n_vert,
        inputs=[work.key],
        outputs=[work.cell_start, work.cell_vert],
    )
    c.n_found.zero_()
    wp.launch(
        hashing.visit_tets,
        dim=model.n_tet,
        inputs=[model.cell, c.skin, model.tets, model.vert_body, model.body_vert, of]
        + [work.cell_start, work.cell_vert, c.x],
        outputs=[c.vert_tet, c.n_found],
    )
    if model.n_plane:
        wp.launch(
            hashing.visit_planes,
            dim=model.n_surf,
            inputs=[model.n_tet, c.skin, work.awake.bodies, model.surf, model.vert_body]
            + [model.plane_n, model.plane_h, c.x],
            outputs=[c.vert_tet, c.n_found],
        )
    _by_pair(c.n_found, c.vert_tet, model.tet_body, c.verts, work.contacts.needed[2:4])


def _find_tris(model: Model, work: Work) -> None:
    """Set the pairs of surface edges and bodies, and their triangles."""
    c = work.candidates
    of = work.near
    c.n_found.zero_()
    wp.launch(
        edges.visit_edges,
        dim=model.n_edge,
        inputs=[c.skin, work.surface.id, model.tris, model.edges, model.vert_body, of]
        + [c.near_tri, work.tri_lower, work.tri_upper, c.x],
        outputs=[c.edge_tri, c.n_found],
    )
    _by_pair(c.n_found, c.edge_tri, model.tri_body, c.edges, work.contacts.needed[4:6])


def _by_pair(
    n_found: wp.array, found: wp.array, item_body: wp.array, pairs: Pairs, needed: wp.array
) -> None:
    """Sort the items found by owner and body; ``needed`` is that of the pairs and the items."""
    n_owner = pairs.start.shape[0] - 1
    pairs.item_start.zero_()
    launch_over(
        kernels.count_items,
        found.shape[0],
        inputs=[n_found, found],
        outputs=[pairs.item_start, needed[1:2]],
    )
    wp.utils.array_scan(pairs.item_start, pairs.item_start, inclusive=True)
    launch_over(
        kernels.fill_items,
        found.shape[0],
        inputs=[n_found, found],
        outputs=[pairs.item_start, pairs.item],
    )
    launch_over(
        kernels.count_pairs,
        n_owner,
        inputs=[item_body, pairs.item_start],
        outputs=[pairs.item, pairs.start],
    )
    wp.utils.array_scan(pairs.start, pairs.start, inclusive=False)
    launch_over(
        kernels.list_pairs,
        n_owner,
        inputs=[item_body, pairs.item_start, pairs.item, pairs.start],
        outputs=[pairs.n, pairs.pair, pairs.items, needed[0:1]],
    )
