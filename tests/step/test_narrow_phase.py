"""narrow_phase.py: the vertices inside other bodies, against brute force; their order."""

import numpy as np
import pytest
import warp as wp

from warp_contact import NeoHookean, Scene, TetMesh, box
from warp_contact.scene.scene import rotation_matrix
from warp_contact.step import broad_phase, narrow_phase

RUBBER = NeoHookean(1e5, 0.3, 1000.0)


def found(model, state, work) -> list[tuple[int, int]]:
    """Vertices and the bodies that they lie in, as listed."""
    broad_phase.refresh(model, state.x, state.x, work)
    narrow_phase.find_vertices(model, state.x, state.x, work)
    inside = work.narrow_phase.penetration.numpy()[: work.contacts.n_vertex.numpy()[0]]
    return list(zip(inside["vert"].tolist(), inside["body"].tolist(), strict=True))


@pytest.mark.parametrize("worlds", [1, 3])
def test_hashing_finds_what_brute_force_finds(rng, stages, jittered, turned, brute_force, worlds):
    scene = Scene()
    for k in range(7):
        mesh = jittered(rng.uniform(0.3, 1.0), int(rng.integers(1, 5)))
        # Around the origin, and once more far from it.
        place = rng.uniform(-0.4, 0.4, 3) + (k % 2) * np.array([-5.0, -7.0, 3.0])
        scene.add_body(mesh, RUBBER, place, turned(), world=int(rng.integers(worlds)))
    model, state, work = stages(scene)
    pairs = found(model, state, work)
    sure, doubtful = brute_force(scene, state.x.numpy().astype(float))
    assert len(pairs) == len(set(pairs))
    assert sure <= set(pairs) <= sure | doubtful
    assert not work.overflow.all.numpy().any()


def test_equal_hashes_list_no_vertex_twice(rng, stages, turned, brute_force):
    """In a table of so few places that most cells share one with others that a tet visits."""
    scene = Scene()
    for _ in range(2):
        scene.add_body(box(1.0, 5), RUBBER, rng.uniform(-0.2, 0.2, 3), turned())
    model, state, work = stages(scene)
    work.broad_phase.cell_start = wp.zeros(4, dtype=int)
    pairs = found(model, state, work)
    listed = work.broad_phase.verts
    for first, end in listed.list.items.numpy()[: listed.n.numpy()[0]]:
        tets = listed.list.item.numpy()[first:end]
        assert len(np.unique(tets)) == len(tets)
    sure, doubtful = brute_force(scene, state.x.numpy().astype(float))
    assert sure <= set(pairs) <= sure | doubtful


def test_a_body_near_very_many_others_misses_none(rng, stages, jittered, turned, brute_force):
    scene = Scene()
    scene.add_body(box((3.0, 3.0, 0.2), (6, 6, 1)), RUBBER)
    for k in range(49):
        place = (0.4 * (k % 7) - 1.2, 0.4 * (k // 7) - 1.2, rng.uniform(0.1, 0.22))
        scene.add_body(jittered(0.2, 1), RUBBER, place, turned())
    model, state, work = stages(scene)
    pairs = set(found(model, state, work))
    near = work.broad_phase.near
    assert near.n_near.numpy()[0] > near.other.shape[1]
    sure, doubtful = brute_force(scene, state.x.numpy().astype(float))
    assert sure and sure <= pairs <= sure | doubtful
    narrow_phase.clear_places(work)
    narrow_phase.find_edges(model, state.x, state.x, work)
    assert work.narrow_phase.n_crossing.numpy()[0] > 0


def test_several_bodies_at_one_vertex_are_all_found(stages, turned):
    scene = Scene()
    for k in range(5):
        scene.add_body(box(1.0 + 0.1 * k, 2), RUBBER, (-3.0, 2.0, -1.0), turned())
    model, state, work = stages(scene)
    centre = 13  # of the 27 vertices of each box
    pairs = set(found(model, state, work))
    for a in range(5):
        assert {(27 * a + centre, b) for b in range(5) if b != a} <= pairs


def test_points_on_faces_edges_and_corners_are_inside_once(stages):
    lattice = box(2.0, 2)  # vertices, edges and faces of the tets at whole numbers
    at = [(0.0, 0.5, 0.25), (0.0, 0.5, 0.5), (-1.0, 0.5, 0.25), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)]
    away = np.array([[3.0, 0.0, 0.0], [3.0, 1.0, 0.0], [3.0, 0.0, 1.0]])
    scene = Scene()
    scene.add_body(lattice, RUBBER)
    for point in at:
        scene.add_body(TetMesh([point, *away], [[0, 1, 2, 3]]), RUBBER, world=0)
    model, state, work = stages(scene)
    pairs = found(model, state, work)
    for k in range(len(at)):
        assert pairs.count((27 + 4 * k, 0)) == 1


def test_penetrations_are_sorted_by_vertex_and_body_with_planes_last(rng, stages, jittered, turned):
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), -0.1)
    for _ in range(5):
        scene.add_body(jittered(1.0, 2), RUBBER, rng.uniform(-0.3, 0.3, 3), turned())
    model, state, work = stages(scene)
    got = found(model, state, work)
    below = np.flatnonzero(
        (state.x.numpy()[:, 2] < np.float32(-0.1)) & (model.on_surface.numpy() == 1)
    )
    assert got == sorted(got) and len(got) > len(below) > 0
    assert {i for i, body in got if body == model.n_body} == set(below.tolist())


@pytest.mark.parametrize("turn", [0.0, 0.1])
def test_a_vertex_that_goes_through_a_plate_meets_the_side_by_which_it_came(
    stages, find_contacts, turn
):
    """Both bodies move in the step, the plate by a part of the way and turning."""
    scene = Scene()
    scene.add_body(box((2.0, 2.0, 0.02), (4, 4, 1)), RUBBER)
    scene.add_body(box(0.5, 1), RUBBER, (0.11, 0.07, 0.5))
    model, state, work = stages(scene)
    x0 = state.x.numpy()
    x1, plate = x0.copy(), model.vert_body.numpy() == 0
    about = np.array([np.sin(turn / 2), 0.0, 0.0, np.cos(turn / 2)])
    x1[plate] = x0[plate] @ rotation_matrix(about).T + (0.0, 0.0, -0.1)
    x1[~plate, 2] -= 1.0  # the block, 0.5 high, lies below the plate then
    moved = wp.array(x1.astype(np.float32), dtype=wp.vec3)
    c = find_contacts(model, work, state.x, moved, apart=True)
    of_block = c.pair[:, 0] == 1
    assert {*c.vert[of_block, 0]} == {*np.flatnonzero(~plate)}
    up = rotation_matrix(about)[:, 2]
    np.testing.assert_allclose(c.normal[of_block], np.tile(up, (of_block.sum(), 1)), atol=1e-5)
    gaps = np.einsum("ckx,ck,cx->c", x0[c.vert], c.coef, c.normal)[of_block]
    assert (gaps > 0.2).all()  # they begin above it
    # Where nothing moves there is nothing to find.
    assert not (find_contacts(model, work, moved, apart=True).pair[:, 0] == 1).any()
