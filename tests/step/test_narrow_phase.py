"""The broad and the narrow phase against brute force, over many steps; buffers that grow."""

from dataclasses import astuple, fields, replace

import numpy as np
import pytest
import warp as wp

from warp_contact import NeoHookean, Scene, Simulation, TetMesh, box
from warp_contact.data import warm_start
from warp_contact.data.contacts import Capacity
from warp_contact.data.work import allocate_work
from warp_contact.step import broad_phase, narrow_phase, step

RUBBER = NeoHookean(1e5, 0.3, 1000.0)
# float32 weights of the tets below (edges of 0.1 to 1, coordinates below 10) are good to this;
# pairs that are closer to a face are left to rounding.
DOUBT = 1e-3
SKIN = 0.02  # weight that the skin of stage 1, 1e-3 of an edge, may reach in a flat tet
LISTS = ["verts", "tets", "edges", "tris", "near"]


def weights(x: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Barycentric weights of all points in all tets, shape (n, m, 4)."""
    inverse = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    w = np.einsum("mij,nmj->nmi", inverse, x[:, None] - corners[None, :, 0])
    return np.concatenate([1.0 - w.sum(axis=2, keepdims=True), w], axis=2)


def brute_force(scene: Scene, x: np.ndarray) -> tuple[set, set]:
    """(vertex, body) pairs that are certain, and those that are near a face."""
    sure, doubtful = set(), set()
    first = np.cumsum([0] + [len(b.x) for b in scene.bodies])
    for body, i0, i1 in zip(scene.bodies, first, first[1:], strict=False):
        margin = weights(x, x[i0:i1][body.mesh.tets]).min(axis=2).max(axis=1)
        for other, j0, j1 in zip(scene.bodies, first, first[1:], strict=False):
            if other is not body and other.world == body.world:
                for i in range(j0, j1):
                    if margin[i] > DOUBT:
                        sure.add((i, body.index))
                    elif margin[i] > -SKIN:
                        doubtful.add((i, body.index))
    return sure, doubtful


def found(model, state, work) -> list[tuple[int, int]]:
    broad_phase.refresh(model, state.x, state.x, work)
    narrow_phase.find_hits(model, state.x, work)
    n = int(work.n_hit.numpy()[0])
    return list(
        zip(work.hit_vert.numpy()[:n].tolist(), work.hit_body.numpy()[:n].tolist(), strict=True)
    )


@pytest.mark.parametrize("worlds", [1, 3])
def test_hashing_finds_what_brute_force_finds(rng, stages, jittered, turned, worlds):
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
    assert not work.contacts.needed.numpy().any()


def test_a_body_near_very_many_others_misses_none(rng, stages, jittered, turned):
    scene = Scene()
    scene.add_body(box((3.0, 3.0, 0.2), (6, 6, 1)), RUBBER)
    for k in range(49):
        place = (0.4 * (k % 7) - 1.2, 0.4 * (k // 7) - 1.2, rng.uniform(0.1, 0.22))
        scene.add_body(jittered(0.2, 1), RUBBER, place, turned())
    model, state, work = stages(scene)
    pairs = set(found(model, state, work))
    assert work.near.n_near.numpy()[0] > work.near.near.shape[1]
    sure, doubtful = brute_force(scene, state.x.numpy().astype(float))
    assert sure and sure <= pairs <= sure | doubtful
    step.edge_contacts(model, state.x, state.x, work, fresh=False)
    assert work.n_crossing.numpy()[0] > 0


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


def test_bodies_of_different_worlds_are_never_near(stages, jittered):
    scene = Scene()
    mesh = jittered(1.0, 2)
    for k, world in enumerate((0, 1, 1, 2)):
        scene.add_body(mesh, RUBBER, (0.1 * k, 0.0, 0.0), world=world)
    model, state, work = stages(scene)
    broad_phase.refresh(model, state.x, state.x, work)
    np.testing.assert_array_equal(work.near.n_near.numpy(), [0, 1, 1, 0])
    assert work.near.near.numpy()[1, 0] == 2 and work.near.near.numpy()[2, 0] == 1


def test_near_bodies_have_boxes_that_meet_and_none_that_touches_is_missed(rng, stages, turned):
    scene = Scene()
    for _ in range(19):
        scene.add_body(box(0.5, 1), RUBBER, rng.uniform(-1.0, 1.0, 3), turned())
    scene.add_body(box(0.01, 1), RUBBER, scene.bodies[0].x.mean(axis=0))  # enclosed
    model, state, work = stages(scene)
    broad_phase.refresh(model, state.x, state.x, work)
    x = state.x.numpy().reshape(20, 8, 3)
    skin = work.candidates.skin.numpy()[:, None] + 1e-6  # rounding
    lo, hi = x.min(axis=1) - skin, x.max(axis=1) + skin
    meet = ((lo[:, None] <= hi) & (lo <= hi[:, None])).all(axis=2) & ~np.eye(20, dtype=bool)
    near = np.zeros((20, 20), dtype=bool)
    for body, n in enumerate(work.near.n_near.numpy()):
        listed = work.near.near.numpy()[body, :n]
        assert (np.diff(listed) > 0).all()
        near[body, listed] = True
    assert not (near & ~meet).any() and (near == near.T).all()
    sure, _ = brute_force(scene, state.x.numpy().astype(float))
    assert all(near[i // 8, body] for i, body in sure) and near[0, 19]


def test_a_fast_body_does_not_reach_for_others_with_its_own_skin(stages):
    """Where it has the longest skin only because nothing is near, it lasts without candidates."""
    found = []
    for away in (0.06, 1.0):
        scene, dt, v = Scene(), 1e-3, np.array([2.0, 0.0, 0.0])
        scene.add_body(box(0.1, 2), RUBBER)
        scene.add_body(box(0.1, 2), RUBBER, (0.1 + away, 0.0, 0.0), velocity=v)
        model, state, work = stages(scene, dt=dt)
        x1 = wp.array(state.x.numpy() + dt * state.v.numpy(), dtype=wp.vec3)
        broad_phase.refresh(model, state.x, x1, work)
        free = work.candidates.free.numpy()
        pairs = work.candidates.edges.n.numpy()[0] + work.candidates.verts.n.numpy()[0]
        found.append((free[1] / (dt * v[0]), pairs))
    (short, none), (long, none_either) = found
    # A few motions when the other one, at rest, is within 32 of them.
    assert none == none_either == 0
    assert 1.0 <= short < 8.0
    assert long == pytest.approx(32.0, rel=1e-3)


def test_nothing_is_looked_for_where_no_body_is_near(stages, monkeypatch):
    looked = []
    monkeypatch.setattr(
        broad_phase, "_find_tets", lambda *a, f=broad_phase._find_tets: looked.append(f(*a))
    )
    for away, plane in ((0.101, False), (1.0, False), (1.0, True)):
        scene = Scene()
        if plane:
            scene.add_plane((0.0, 0.0, 1.0), -0.05)
        scene.add_body(box(0.1, 2), RUBBER)
        scene.add_body(box(0.1, 2), RUBBER, (away, 0.0, 0.0))
        model, state, work = stages(scene)
        looked.clear()
        broad_phase.refresh(model, state.x, state.x, work)
        c = work.candidates
        near = away < 0.5
        assert len(looked) == (1 if near or plane else 0)
        assert (c.edges.n.numpy()[0] > 0) == near and (c.verts.n.numpy()[0] > 0) == (near or plane)
        assert c.some.numpy()[0] == (1 if near or plane else 0)
        # They part: what was listed is forgotten.
        x = state.x.numpy()
        x[model.vert_body.numpy() == 1] += (3.0, 0.0, 1.0)
        state.x.assign(x)
        broad_phase.refresh(model, state.x, state.x, work)
        for pairs in (c.edges,) if plane else (c.edges, c.verts):
            assert pairs.n.numpy()[0] == 0
            assert not pairs.start.numpy().any() and not pairs.item_start.numpy().any()
        assert plane or c.some.numpy()[0] == 0


def test_what_has_become_fast_is_looked_at_anew(stages):
    scene, dt, v = Scene(), 1e-3, np.array([2.0, 0.0, 0.0])
    scene.add_body(box(0.1, 2), RUBBER, velocity=v)
    scene.add_body(box(0.1, 2), RUBBER, (1.0, 0.0, 0.0))
    model, state, work = stages(scene, dt=dt)
    x = state.x.numpy()
    c, own = work.candidates, (model.vert_body.numpy() == 0)[:, None]
    broad_phase.refresh(model, state.x, wp.array(x + dt * v * own, dtype=wp.vec3), work)
    assert c.free.numpy()[0] > 30.0 * dt * v[0]
    for steps, anew in ((1.5, False), (3.0, True)):  # far less than is free
        x = x + 1e-4 * own
        ahead = wp.array(x + steps * dt * v * own, dtype=wp.vec3)
        broad_phase.refresh(model, wp.array(x, dtype=wp.vec3), ahead, work)
        assert np.array_equal(c.x.numpy(), x.astype(np.float32)) == anew


def test_hits_are_sorted_by_vertex_and_body_with_planes_last(rng, stages, jittered, turned):
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


def crowd(rng, turned) -> Scene:
    scene = Scene()
    for _ in range(6):
        scene.add_body(box(0.2, 2), RUBBER, rng.uniform(-0.06, 0.06, 3), turned())
    scene.add_plane((0.0, 0.0, 1.0), -0.05)
    return scene


@pytest.mark.parametrize("name", ["contacts", *LISTS])
def test_what_does_not_fit_is_counted(rng, stages, turned, name):
    k = [field.name for field in fields(Capacity)].index(name)
    scene = crowd(rng, turned)
    room = Capacity(4096, 64, 4096, 65536, 4096, 65536, 65536)
    ample = stages(scene, room)
    assert found(*ample) and not ample[2].contacts.needed.numpy().any()
    model, state, work = stages(scene, replace(room, **{name: 2}))
    broad_phase.refresh(model, state.x, state.x, work)
    step.vertex_contacts(model, state.x, state.x, work, fresh=False)
    needed = work.contacts.needed.numpy()
    assert needed[k] > 2 and np.count_nonzero(needed) == 1
    if name in LISTS:  # then the list stays empty
        model, state, work = stages(scene, replace(room, **{name: int(needed[k])}))
        found(model, state, work)
        assert not work.contacts.needed.numpy().any()


def test_a_simulation_grows_its_buffers_and_loses_nothing(rng, turned):
    scene = crowd(rng, turned)
    tiny = Simulation(scene, fps=1000)
    ample = Simulation(scene, fps=1000)
    tight = Capacity(*[1] * 7)
    roomy = Capacity(8192, 64, 8192, 65536, 8192, 65536, 65536)
    tiny._stepper.use(allocate_work(tiny.model, tiny.state, tight))
    ample._stepper.use(allocate_work(ample.model, ample.state, roomy))
    for sim in (tiny, ample):
        sim.step_frame()
    np.testing.assert_array_equal(tiny.positions(), ample.positions())
    np.testing.assert_array_equal(tiny.velocities(), ample.velocities())
    assert tiny.measure().forces == ample.measure().forces
    assert min(astuple(tiny._stepper.work.capacity)) > 1


def pile(rng, turned) -> Scene:
    """Blocks that fall onto each other and a floor, all touching within a few frames."""
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    for k in range(8):
        place = rng.uniform(-0.05, 0.05, 3) + [0.0, 0.0, 0.2 + 0.22 * k]
        velocity = rng.uniform(-0.5, 0.5, 3) - [0.0, 0.0, 1.0 + 0.5 * k]
        soft = NeoHookean(3e4, 0.3, 1000.0, 2e-3)
        scene.add_body(box(0.16, 2), soft, place, turned(), velocity)
    return scene


def test_buffers_that_grow_on_the_way_change_nothing(rng, turned):
    scene = pile(rng, turned)
    tight, ample = Simulation(scene), Simulation(scene)
    shrunk = -1
    for frame in range(16):
        before = tight._stepper.work.warm  # with the impulses that the next frame starts from
        held = int(before.n_held.numpy()[0])
        if frame >= 4 and held > 0 and shrunk < 0:
            shrunk = frame
            tight._stepper.use(allocate_work(tight.model, tight.state, Capacity(held, *[1] * 6)))
            warm_start.copy(tight._stepper.work.warm, before)
        for sim in (tight, ample):
            # Short steps, which lengthen by a part from frame to frame, not from try to try.
            sim._stepper.n = max(sim.substeps, 40)
            sim.step_frame()
        assert tight.substeps == ample.substeps
        np.testing.assert_array_equal(tight.positions(), ample.positions())
        np.testing.assert_array_equal(tight.velocities(), ample.velocities())
        if shrunk >= 0 and frame >= shrunk + 3:
            break
    assert shrunk >= 0


def test_candidates_kept_for_many_steps_give_the_same_bits_as_new_ones(rng, turned, monkeypatch):
    scene = pile(rng, turned)
    kept, renewed = Simulation(scene), Simulation(scene)
    launched = broad_phase.refresh
    rebuilt = 0
    for _ in range(20):
        kept.step_frame()
        # Where nothing is free they are stale in every step.
        with monkeypatch.context() as m:
            m.setattr(
                broad_phase, "refresh", lambda *a: (a[3].candidates.free.zero_(), launched(*a))
            )
            renewed.step_frame()
        rebuilt += int(renewed.measure().n_contacts > 0)
        np.testing.assert_array_equal(kept.positions(), renewed.positions())
        np.testing.assert_array_equal(kept.velocities(), renewed.velocities())
    assert rebuilt > 5


def test_a_deep_overlap_beyond_the_first_buffer_is_searched_all_the_same():
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    scene.add_body(box(0.2, 1), RUBBER, (1.0, 0.0, 0.1 - 1e-6))  # four shallow contacts come first
    for k, z in enumerate((1.0, 1.18)):
        scene.add_body(box(0.2, 2), NeoHookean(1e5 * 10**k, 0.3, 1000.0), (0.0, 0.0, z))
    tiny, ample = Simulation(scene, fps=1000), Simulation(scene, fps=1000)
    tiny._stepper.use(allocate_work(tiny.model, tiny.state, Capacity(contacts=4)))
    for sim in (tiny, ample):
        sim.step_frame()
    np.testing.assert_array_equal(tiny.positions(), ample.positions())
