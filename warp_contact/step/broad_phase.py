"""Broad phase: which vertices may enter which bodies, and which edges may cross them.

Pairs are found now and then, and kept for many steps.
"""

from functools import partial

import warp as wp

from warp_contact.data import boxes
from warp_contact.data.broad_phase import Pairs, Travel
from warp_contact.data.launch import if_any, launch_over
from warp_contact.data.model import Model
from warp_contact.data.scan import scan
from warp_contact.data.switches import on
from warp_contact.data.work import Work
from warp_contact.kernels.broad_phase import edges, hashing, near, skins
from warp_contact.kernels.broad_phase import pairs as kernels
from warp_contact.step.ties import keep_apart


def refresh(model: Model, x0: wp.array, x1: wp.array, work: Work) -> None:
    """Find the pairs half way from ``x0`` to ``x1``, unless the present ones hold that step."""
    b = work.broad_phase
    if not on("broad phase kept"):
        b.stale.fill_(1)
    wp.launch(
        skins.moved,
        dim=model.n_vert,
        inputs=[model.vert_body, b.free, b.skin, b.x, x0, x1],
        outputs=[b.stale, b.age],
    )
    if_any(b.stale, _find, model, x0, x1, work)


def track(model: Model, x: wp.array, travel: Travel, work: Work) -> None:
    """Begin a detection pass at ``x``: add the distances travelled; no contact is new yet."""
    _move(model, x, travel.last, travel.motion)
    outputs = [travel.motion, travel.recent, travel.travelled, work.narrow_phase.new]
    wp.launch(skins.add_motion, dim=model.n_body, inputs=[], outputs=outputs)


def _find(model: Model, x0: wp.array, x1: wp.array, work: Work) -> None:
    b = work.broad_phase
    b.drift.zero_()
    _move(model, x0, b.x, b.drift)
    wp.launch(skins.between, dim=model.n_vert, inputs=[x0, x1], outputs=[b.x])
    for pairs in (b.verts, b.edges):
        wp.copy(pairs.travel.last, x0)
        pairs.travel.motion.zero_()
        pairs.travel.travelled.zero_()
        pairs.clear_until.fill_(-1.0)
    b.apart.gap.zero_()
    b.beside.until.fill_(-1.0)
    _choose_skins(model, x1, work)
    if model.n_plane:
        _list_pairs(model, work)
    else:
        if_any(b.any_pair, _list_pairs, model, work, otherwise=partial(_list_none, work))
    if work.ties:
        keep_apart(model, work)


def _list_pairs(model: Model, work: Work) -> None:
    b = work.broad_phase
    _find_parts(model, work)
    _find_tets(model, work)
    _find_tris(model, work)
    wp.launch(kernels.any_pairs, dim=1, inputs=[b.verts.n, b.edges.n], outputs=[b.any_pair])


def _list_none(work: Work) -> None:
    for pairs in (work.broad_phase.verts, work.broad_phase.edges):
        pairs.n.zero_()
        pairs.list.start.zero_()
        pairs.item_start.zero_()


def _move(model: Model, x: wp.array, last: wp.array, motion: wp.array) -> None:
    """Update ``motion`` of each body by that from ``last``, which becomes ``x``."""
    chunks = -(-model.n_vert // int(skins.CHUNK))
    inputs = [model.vert_body, x]
    wp.launch(skins.find_motion, dim=chunks, inputs=inputs, outputs=[last, motion])


def _choose_skins(model: Model, x1: wp.array, work: Work) -> None:
    """Set ``free`` and ``skin`` for a step to ``x1``, ``near`` and the boxes of the bodies."""
    b, edge = work.broad_phase, work.mesh.shortest_edge
    motion = b.verts.travel.motion
    b.fastest.zero_()
    _move(model, x1, b.verts.travel.last, motion)
    b.total.zero_()
    wp.launch(
        skins.find_fastest,
        dim=model.n_body,
        inputs=[edge, motion, b.edges.travel.recent, b.drift, b.age],
        outputs=[b.rate, b.fastest, b.total],
    )
    inputs = [edge, b.fastest, motion, b.rate]
    wp.launch(skins.widest_skins, dim=model.n_body, inputs=inputs, outputs=[b.skin])
    _find_near(model, work)
    wp.launch(
        skins.choose_skins,
        dim=model.n_body,
        inputs=[edge, b.total, motion, b.rate, b.near],
        outputs=[b.free, b.skin, b.stale, b.any_pair, b.age],
    )
    _find_near(model, work)


def _find_near(model: Model, work: Work) -> None:
    """Set the bodies that may touch, within their skins, and their Bvh."""
    b, of = work.broad_phase, work.broad_phase.near
    boxes.of_bodies(model, b.x, b.skin, b.lower, b.upper)
    b.bodies.refit()
    wp.launch(
        near.near_bodies,
        dim=model.n_body,
        inputs=[model.cell, b.skin, b.bodies.id, model.body_world, model.body_vert]
        + [work.awake.bodies, b.lower, b.upper, b.x],
        outputs=[of.n_near, of.other, of.slab, of.end, b.any_pair],
    )


def _find_parts(model: Model, work: Work) -> None:
    """Set which parts of near bodies may touch, and the Bvh over the triangles."""
    b, of = work.broad_phase, work.broad_phase.near
    boxes.of_triangles(model, b.x, b.skin, of.n_near, b.tri_lower, b.tri_upper)
    b.surface.refit()
    b.n_found.zero_()
    wp.launch(
        near.near_parts,
        dim=of.other.shape,
        inputs=[b.skin, work.mesh, of, b.x],
        outputs=[of.part, b.near_tri, b.n_found],
    )
    wp.launch(
        near.fits,
        dim=1,
        inputs=[work.capacity.near],
        outputs=[b.n_found, work.overflow.near],
    )


def _find_tets(model: Model, work: Work) -> None:
    """Set the pairs of vertices and bodies, and their tets."""
    b = work.broad_phase
    b.cell_start.zero_()
    wp.launch(
        hashing.count_cells,
        dim=model.n_vert,
        inputs=[model.cell, b.skin, model.vert_body, b.near, b.x],
        outputs=[b.key, b.cell_start],
    )
    scan(b.cell_start, work.scan, inclusive=True)
    wp.launch(
        hashing.fill_cells,
        dim=model.n_vert,
        inputs=[b.key],
        outputs=[b.cell_start, b.cell_vert],
    )
    b.n_found.zero_()
    wp.launch(
        hashing.visit_tets,
        dim=model.n_tet,
        inputs=[model.cell, b.skin, work.mesh, b.near, b.cell_start, b.cell_vert, b.x],
        outputs=[b.vert_tet, b.n_found],
    )
    if model.n_plane:
        wp.launch(
            hashing.visit_planes,
            dim=model.n_surf,
            inputs=[model.n_tet, b.skin, work.awake.bodies, model.surf, model.vert_body]
            + [model.plane_n, model.plane_h, b.x],
            outputs=[b.vert_tet, b.n_found],
        )
    overflow = work.overflow.verts, work.overflow.tets
    _by_pair(b.n_found, b.vert_tet, model.tet_body, b.verts, work, *overflow)


def _find_tris(model: Model, work: Work) -> None:
    """Set the pairs of surface edges and bodies, and their triangles."""
    b = work.broad_phase
    b.n_found.zero_()
    wp.launch(
        edges.visit_edges,
        dim=model.n_edge,
        inputs=[b.skin, work.mesh, b.near, b.near_tri, b.tri_lower, b.tri_upper, b.x],
        outputs=[b.edge_tri, b.n_found],
    )
    overflow = work.overflow.edges, work.overflow.tris
    _by_pair(b.n_found, b.edge_tri, model.tri_body, b.edges, work, *overflow)


def _by_pair(
    n_found: wp.array,
    found: wp.array,
    item_body: wp.array,
    pairs: Pairs,
    work: Work,
    pairs_needed: wp.array,
    items_needed: wp.array,
) -> None:
    """Sort the items found by owner and body; count the pairs and items that do not fit."""
    to = pairs.list
    n_owner = to.start.shape[0] - 1
    pairs.item_start.zero_()
    launch_over(
        kernels.count_items,
        found.shape[0],
        inputs=[n_found, found],
        outputs=[pairs.item_start, items_needed],
    )
    scan(pairs.item_start, work.scan, inclusive=True)
    launch_over(
        kernels.fill_items,
        found.shape[0],
        inputs=[n_found, found],
        outputs=[pairs.item_start, to.item],
    )
    launch_over(
        kernels.count_pairs,
        n_owner,
        inputs=[item_body, pairs.item_start],
        outputs=[to.item, to.start],
    )
    scan(to.start, work.scan, inclusive=False)
    launch_over(
        kernels.list_pairs,
        n_owner,
        inputs=[item_body, pairs.item_start, to.item, to.start],
        outputs=[to.n, to.pair, to.items, pairs_needed],
    )
