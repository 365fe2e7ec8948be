"""broad_phase.py: which bodies are near, and for how long what was found holds."""

import numpy as np
import warp as wp

from warp_contact import NeoHookean, Scene, Simulation, box
from warp_contact.data.overflow import Capacity
from warp_contact.kernels.broad_phase import hashing
from warp_contact.kernels.broad_phase import near as near_kernels
from warp_contact.kernels.broad_phase import pairs as pair_kernels
from warp_contact.step import broad_phase, narrow_phase

RUBBER = NeoHookean(1e5, 0.3, 1000.0)


def test_bodies_of_different_worlds_are_never_near(stages, jittered):
    scene = Scene()
    mesh = jittered(1.0, 2)
    for k, world in enumerate((0, 1, 1, 2)):
        scene.add_body(mesh, RUBBER, (0.1 * k, 0.0, 0.0), world=world)
    model, state, work = stages(scene)
    broad_phase.refresh(model, state.x, state.x, work)
    near = work.broad_phase.near
    np.testing.assert_array_equal(near.n_near.numpy(), [0, 1, 1, 0])
    assert near.other.numpy()[1, 0] == 2 and near.other.numpy()[2, 0] == 1


def test_near_bodies_have_boxes_that_meet_and_none_that_touches_is_missed(
    rng, stages, turned, brute_force
):
    scene = Scene()
    for _ in range(19):
        scene.add_body(box(0.5, 1), RUBBER, rng.uniform(-1.0, 1.0, 3), turned())
    scene.add_body(box(0.01, 1), RUBBER, scene.bodies[0].x.mean(axis=0))  # enclosed
    model, state, work = stages(scene)
    broad_phase.refresh(model, state.x, state.x, work)
    x = state.x.numpy().reshape(20, 8, 3)
    skin = work.broad_phase.skin.numpy()[:, None] + 1e-6  # rounding
    lo, hi = x.min(axis=1) - skin, x.max(axis=1) + skin
    meet = ((lo[:, None] <= hi) & (lo <= hi[:, None])).all(axis=2) & ~np.eye(20, dtype=bool)
    near = np.zeros((20, 20), dtype=bool)
    for body, n in enumerate(work.broad_phase.near.n_near.numpy()):
        listed = work.broad_phase.near.other.numpy()[body, :n]
        assert (np.diff(listed) > 0).all()
        near[body, listed] = True
    assert not (near & ~meet).any() and (near == near.T).all()
    sure, _ = brute_force(scene, state.x.numpy().astype(float))
    assert all(near[i // 8, body] for i, body in sure) and near[0, 19]


def listed(pairs) -> set[tuple[int, int]]:
    """The owners of a list of pairs, and their bodies."""
    return set(map(tuple, pairs.list.pair.numpy()[: pairs.n.numpy()[0]].tolist()))


def crossed(model, x, bodies) -> set[tuple[int, int]]:
    """Surface edges of some bodies, and the bodies whose triangles they cross for sure."""
    tris, edges, owner = model.tris.numpy(), model.edges.numpy(), model.tri_body.numpy()
    a, b, c = np.moveaxis(x[tris], 1, 0)
    p, q = x[edges[:, 0]], x[edges[:, 1]]
    own = model.vert_body.numpy()[edges[:, 0]]
    found = set()
    for e in np.flatnonzero(np.isin(own, bodies)):
        others = owner != own[e]
        sides = np.stack([np.broadcast_to(q[e] - p[e], a.shape), a - b, a - c], axis=2)
        others &= np.abs(np.linalg.det(sides)) > 1e-9  # in the plane: no crossing that is sure
        tvw = np.linalg.solve(sides[others], (a - p[e])[others, :, None])[:, :, 0]
        inside = np.column_stack([tvw, 1.0 - tvw[:, 0], 1.0 - tvw[:, 1] - tvw[:, 2]]).min(axis=1)
        found |= {
            (int(e), int(body)) for body in owner[others][inside > 1e-3]
        }  # rounding of float32
    return found


def test_pairs_include_all_that_can_touch_before_a_skin_is_used_up(
    rng, stages, turned, brute_force
):
    """Wherever the vertices are by then, above all where bodies have come together."""
    scene, dt = Scene(gravity=(0.0, 0.0, 0.0)), 1e-2
    scene.add_plane((0.0, 0.0, 1.0), -0.4)
    for k in range(8):
        place = (np.array([k & 1, k >> 1 & 1, k >> 2]) - 0.5) * rng.uniform(0.5, 0.8)
        v = rng.uniform(-3.0, 3.0, 3)
        scene.add_body(box(0.5, 2), RUBBER, place, turned() if k % 2 else (0, 0, 0, 1), v)
    model, state, work = stages(scene, dt=dt)
    x0, own = state.x.numpy().astype(float), model.vert_body.numpy()
    broad_phase.refresh(model, state.x, wp.array(x0 + dt * state.v.numpy(), dtype=wp.vec3), work)
    b = work.broad_phase
    skin, x0 = 0.999 * b.skin.numpy(), b.x.numpy().astype(float)  # rounding
    verts, edges = listed(b.verts), listed(b.edges)
    middle = np.array([x0[own == m].mean(axis=0) for m in range(8)])
    touching = 0
    for m in range(8):
        for other in range(m):
            way = middle[other] - middle[m]
            way /= np.linalg.norm(way)
            x = x0 + rng.uniform(-0.3, 0.3, x0.shape) * skin[own, None]
            x[own == m] = x0[own == m] + skin[m] * way
            x[own == other] = x0[own == other] - skin[other] * way
            sure, _ = brute_force(scene, x)
            across = crossed(model, x, (m, other))
            assert sure <= verts and across <= edges
            touching += len(sure) + len(across)
    assert touching > 0
    down = x0[:, 2] - skin[own]
    below = np.flatnonzero((down < -0.4) & (model.on_surface.numpy() == 1))
    assert len(below) > 0 and {(int(i), model.n_body) for i in below} <= verts


def test_pairs_hold_where_a_fast_body_pushes_one_at_rest(stages):
    """Flush with it, and towards a third, which it meets before the step ends."""
    scene, dt, way = Scene(), 1e-3, 0.02
    for x, v in ((-0.1, way / dt), (0.0, 0.0), (0.1 + 0.9 * way, 0.0)):
        scene.add_body(box(0.1, 2), RUBBER, (x, 0.0, 0.0), velocity=(v, 0.0, 0.0))
    model, state, work = stages(scene, dt=dt)
    x1 = wp.array(state.x.numpy() + dt * state.v.numpy(), dtype=wp.vec3)
    broad_phase.refresh(model, state.x, x1, work)
    verts = listed(work.broad_phase.verts)
    front = np.flatnonzero(box(0.1, 2).vertices[:, 0] > 0.04)
    assert {(27 + int(i), 2) for i in front} <= verts


def test_new_pairs_are_looked_at_at_once(stages):
    """Not only once they have travelled as far as pairs before them were apart."""
    scene = Scene()
    for k in range(2):
        scene.add_body(box(0.1, 2), RUBBER, (0.12 * k, 0.0, 0.0))
    model, state, work = stages(scene)
    ahead = state.x.numpy().copy()
    ahead[27:, 0] -= 0.04
    ahead = wp.array(ahead, dtype=wp.vec3)
    for x, found in ((state.x, False), (ahead, True)):
        work.broad_phase.stale.fill_(1)
        broad_phase.refresh(model, x, ahead, work)
        narrow_phase.find_vertices(model, x, x, work)
        assert (work.contacts.n_vertex.numpy()[0] > 0) == found


def test_a_fast_body_does_not_reach_for_others_with_its_own_skin(stages):
    """Where it has the longest skin only because nothing is near, it lasts without pairs."""
    found = []
    for away in (0.06, 1.0):
        scene, dt, v = Scene(), 1e-3, np.array([2.0, 0.0, 0.0])
        scene.add_body(box(0.1, 2), RUBBER)
        scene.add_body(box(0.1, 2), RUBBER, (0.1 + away, 0.0, 0.0), velocity=v)
        model, state, work = stages(scene, dt=dt)
        x1 = wp.array(state.x.numpy() + dt * state.v.numpy(), dtype=wp.vec3)
        broad_phase.refresh(model, state.x, x1, work)
        b = work.broad_phase
        free = b.free.numpy()
        pairs = b.edges.n.numpy()[0] + b.verts.n.numpy()[0]
        found.append((free[1] / (dt * v[0]), pairs))
    (short, none), (long, none_either) = found
    # A few motions when the other one, at rest, is within 32 of them.
    assert none == none_either == 0
    assert 1.0 <= short < 8.0
    assert 31.0 < long < 32.5


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
        b = work.broad_phase
        near = away < 0.5
        assert len(looked) == (1 if near or plane else 0)
        assert (b.edges.n.numpy()[0] > 0) == near and (b.verts.n.numpy()[0] > 0) == (near or plane)
        assert b.any_pair.numpy()[0] == (1 if near or plane else 0)
        # They part: what was listed is forgotten.
        x = state.x.numpy()
        x[model.vert_body.numpy() == 1] += (3.0, 0.0, 1.0)
        state.x.assign(x)
        broad_phase.refresh(model, state.x, state.x, work)
        for pairs in (b.edges,) if plane else (b.edges, b.verts):
            assert pairs.n.numpy()[0] == 0
            assert not pairs.list.start.numpy().any() and not pairs.item_start.numpy().any()
        assert plane or b.any_pair.numpy()[0] == 0


def test_what_has_become_fast_is_looked_at_anew(stages):
    scene, dt, v = Scene(), 1e-3, np.array([2.0, 0.0, 0.0])
    scene.add_body(box(0.1, 2), RUBBER, velocity=v)
    scene.add_body(box(0.1, 2), RUBBER, (1.0, 0.0, 0.0))
    model, state, work = stages(scene, dt=dt)
    x = state.x.numpy()
    b, own = work.broad_phase, (model.vert_body.numpy() == 0)[:, None]
    broad_phase.refresh(model, state.x, wp.array(x + dt * v * own, dtype=wp.vec3), work)
    assert b.free.numpy()[0] > 30.0 * dt * v[0]
    for steps, anew in ((1.5, False), (20.0, True)):  # less than is free
        x = x + 1e-4 * own
        ahead = wp.array(x + steps * dt * v * own, dtype=wp.vec3)
        broad_phase.refresh(model, wp.array(x, dtype=wp.vec3), ahead, work)
        assert (b.age.numpy()[0] == 0) == anew


def test_pairs_kept_for_many_steps_give_the_same_bits_as_new_ones(pile, monkeypatch):
    kept, renewed = Simulation(pile), Simulation(pile)
    for sim in kept, renewed:  # some draws crush tets: where such a frame is cut depends on room
        sim._stepper.buffers.replace(Capacity(2048, 256, 4096, 2**14, 4096, 2**14, 2**14))
    launched = broad_phase.refresh
    rebuilt = 0
    for _ in range(20):
        kept.step_frame()
        # Where nothing is free they are stale in every step.
        with monkeypatch.context() as m:
            m.setattr(
                broad_phase, "refresh", lambda *a: (a[3].broad_phase.free.zero_(), launched(*a))
            )
            renewed.step_frame()
        rebuilt += int(renewed.measure().n_contacts > 0)
        np.testing.assert_array_equal(kept.positions(), renewed.positions())
        np.testing.assert_array_equal(kept.velocities(), renewed.velocities())
    assert rebuilt > 5


def test_a_count_beyond_two_to_the_31_writes_nowhere_and_asks_for_room():
    """On its way round it is negative: an index that a check against the capacity lets pass."""
    n, many = 5, 2**31 - 3
    x = wp.zeros(n, dtype=wp.vec3)  # below a plane at z = 1
    plane = wp.array([[0.0, 0.0, 1.0]], dtype=wp.vec3), wp.array([1.0], dtype=float)
    body = [wp.zeros(1, dtype=float), wp.full(1, 1, dtype=int), wp.array(np.arange(n), dtype=int)]
    found, n_found = wp.zeros(4, dtype=wp.vec2i), wp.full(1, many, dtype=int)
    inputs = [7, *body, wp.zeros(n, dtype=int), *plane, x]
    wp.launch(hashing.visit_planes, dim=n, inputs=inputs, outputs=[found, n_found])
    assert n_found.numpy()[0] == many + n - 2**32 and not found.numpy().any()
    count, needed = wp.zeros(n + 1, dtype=int), wp.zeros(1, dtype=int)
    wp.launch(pair_kernels.count_items, dim=1, inputs=[1, n_found, found], outputs=[count, needed])
    assert needed.numpy()[0] > 2**30 and not count.numpy().any()
    wp.launch(near_kernels.fits, dim=1, inputs=[4], outputs=[n_found, needed])
    assert needed.numpy()[0] > 2**30 and n_found.numpy()[0] == 0
