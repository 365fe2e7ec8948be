"""narrow_phase.py, edges across other bodies: the ridge against ridge that the paper leaves out."""

import numpy as np
import pytest
import warp as wp

from warp_contact import NeoHookean, Scene, Simulation, TetMesh, box
from warp_contact.scene.scene import rotation_matrix
from warp_contact.step import broad_phase, narrow_phase

RUBBER = NeoHookean(1e5, 0.3, 1000.0)
DEPTH = 0.02


def roof(axis: int, top: float, up: float) -> TetMesh:
    """A tet with one edge along an axis at the height ``top``, the rest of it behind that edge.

    Blunter than 60 degrees: out of a sharper ridge the way is shorter through a side.
    """
    other = 1 - axis
    x = np.zeros((4, 3))
    x[:2, axis] = -0.5, 0.5
    x[2:, other] = -0.5, 0.5
    x[:2, 2] = top
    x[2:, 2] = top - up
    return TetMesh(x, [[0, 1, 2, 3]])


def crossed(rng, turn, shift) -> Scene:
    """Two tets whose edges at z = 0 cross at a right angle, one DEPTH into the other."""
    scene = Scene()
    off = rng.uniform(-0.2, 0.2, 2)
    rotate = rotation_matrix(turn)
    for mesh, place in (
        (roof(0, 0.0, 0.4), (0.0, 0.0, 0.0)),
        (roof(1, 0.0, -0.4), (*off, -DEPTH)),
    ):
        scene.add_body(mesh, RUBBER, rotate @ place + shift, turn)
    return scene


def test_two_crossed_tets_make_a_contact_of_their_edges(rng, stages, find_contacts, turned):
    turn, shift = turned(), rng.uniform(-1.0, 1.0, 3)
    model, state, work = stages(crossed(rng, turn, shift))
    c = find_contacts(model, work, state.x, edges=True)
    assert c.n == 2  # the edge of each
    up = rotation_matrix(turn)[:, 2]
    for k, sign in ((0, -1.0), (1, 1.0)):
        assert c.pair[k].tolist() == [k, 1 - k]
        # Coordinates of order 1 in float32.
        np.testing.assert_allclose(c.normal[k], sign * up, atol=1e-5)
        assert c.depth[k] == pytest.approx(DEPTH, abs=1e-6)
        assert sorted(c.vert[k, :2]) == [4 * k, 4 * k + 1]
        assert set(c.vert[k, 2:]) == {4 * (1 - k), 4 * (1 - k) + 1}
        gap = c.coef[k] @ (state.x.numpy()[c.vert[k]] @ c.normal[k])
        assert gap == pytest.approx(-DEPTH, abs=1e-6)


def test_crossed_beams_are_pushed_apart_along_the_common_perpendicular(
    rng, stages, find_contacts, turned
):
    scene = Scene()
    turn = turned()
    rotate = rotation_matrix(turn)
    radius = 0.1 * np.sqrt(2.0)  # an eighth of a turn about the axis: ridges up and down
    half = np.pi / 8.0
    for axis, z in ((0, 0.0), (1, 2.0 * radius - DEPTH)):
        size = [0.2, 0.2, 0.2]
        size[axis] = 1.0
        eighth = np.sin(half) * np.eye(4)[axis] + np.cos(half) * np.eye(4)[3]
        beam = box(size, 1).transformed(rotation_matrix(eighth))
        scene.add_body(beam, RUBBER, rotate @ (0.0, 0.0, z), turn)
    model, state, work = stages(scene)
    c = find_contacts(model, work, state.x, edges=True)
    assert c.n >= 2
    for k in range(c.n):
        sign = 1.0 if c.pair[k, 0] == 1 else -1.0
        np.testing.assert_allclose(c.normal[k], sign * rotate[:, 2], atol=1e-5)  # float32
        assert c.depth[k] == pytest.approx(DEPTH, abs=1e-6)


def test_edges_that_pass_each_other_make_no_contact(rng, stages, find_contacts, turned):
    scene = crossed(rng, (0.0, 0.0, 0.0, 1.0), np.zeros(3))
    model, state, work = stages(scene)
    x = state.x.numpy()
    x[4:, 2] += 1.001 * DEPTH
    state.x.assign(x)
    assert find_contacts(model, work, state.x, edges=True).n == 0


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_a_piece_under_a_face_is_led_out_by_its_deep_end(stages, find_contacts, turned, share):
    """In by one side of a block, out by another, below its top: as deep there, or less, or not."""
    scene, rotate = Scene(), rotation_matrix(turn := turned())
    cube = box(1.0, 1)
    x = cube.vertices
    # Close to the end of a rim at which the top has a triangle that has no other part in it: the
    # sides are not next to each other, and there is no ridge to lead the edge out by.
    top = next(t for t in cube.surface if (x[t, 2] > 0.4).all() and (x[t, 0] > 0.4).sum() == 1)
    weights = np.where(x[top, 0] > 0.4, 0.8, np.where(x[top, 1] > 0.4, 0.13, 0.07))
    enter = weights @ x[top]
    leave = np.array([0.5, enter[1], 0.5 - 2.0 * DEPTH])
    if share > 0.0:
        enter = np.array([-0.5, enter[1], 0.5 - 2.0 * DEPTH * share])
    along = (leave - enter) * (1.0 if share else 4.0)
    away = [(0.9, enter[1] + side, 2.0) for side in (-0.3, 0.3)]
    scene.add_body(cube, RUBBER, rotation=turn)
    tet = TetMesh([enter - along, leave + along, *away], [[0, 1, 2, 3]])
    scene.add_body(tet, RUBBER, rotation=turn)
    model, state, work = stages(scene)
    c = find_contacts(model, work, state.x, edges=True)
    (k,) = (k for k in range(c.n) if set(c.vert[k, :2]) == {8, 9})
    # The surface is known to 1e-7, and the depth is a 50th of a side.
    np.testing.assert_allclose(c.normal[k], rotate[:, 2], atol=3e-5)
    # The middle is less deep: led out by that much, a part of the piece would still be inside.
    part = share / (1.0 + share)
    depth = 2.0 * DEPTH * (1.0 + share**2) / (1.0 + share)
    assert c.depth[k] == pytest.approx(depth, abs=3e-6)
    own = c.coef[k, :2] @ state.x.numpy()[c.vert[k, :2]]
    # The same of the shallower end, a hundredth of a side deep, moves it by 1e-5 and more.
    np.testing.assert_allclose(own, rotate @ (part * enter + (1.0 - part) * leave), atol=1e-4)


def wedge() -> TetMesh:
    """A ridge of 19 degrees along y, at z = 0."""
    corners = [[s, y, -3.0 if s else 0.0] for y in (-1.0, 1.0) for s in (-0.5, 0.5, 0.0)]
    return TetMesh(corners, [[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5]])


@pytest.mark.parametrize("apart", [False, True])
def test_sharp_ridges_lead_each_other_out_along_their_common_perpendicular(
    rng, stages, find_contacts, turned, apart
):
    """Although the sides of a ridge are six times nearer than it."""
    scene, rotate = Scene(), rotation_matrix(turn := turned())
    half = 0.5**0.5
    scene.add_body(wedge(), RUBBER, rotation=turn)
    # Upside down, and across: about the diagonal of x and y.
    other = wedge().transformed(rotation_matrix((half, half, 0.0, 0.0)))
    x = rotate @ (*rng.uniform(-0.2, 0.2, 2), -DEPTH)
    scene.add_body(other, RUBBER, x, turn)
    model, state, work = stages(scene)
    inside = wp.array(state.x.numpy(), dtype=wp.vec3)
    if apart:  # it came in within the step
        start = state.x.numpy()
        start[6:] += (DEPTH + 1e-3) * rotate[:, 2].astype(np.float32)
        state.x.assign(start)
    c = find_contacts(model, work, state.x, inside, edges=True, apart=apart)
    ridges = [k for k in range(c.n) if set(c.vert[k, :2]) in ({2, 5}, {8, 11})]
    assert len(ridges) == 2
    for k in ridges:
        sign = 1.0 if c.pair[k, 0] == 1 else -1.0
        np.testing.assert_allclose(c.normal[k], sign * rotate[:, 2], atol=1e-4)  # float32
        assert c.depth[k] == pytest.approx(DEPTH, abs=2e-6)


def test_edges_that_come_nearer_in_small_steps_are_found_in_time(rng, stages, turned):
    """A pair that is apart is left alone, but not for longer than it takes to touch."""
    scene = crossed(rng, turn := turned(), np.zeros(3))
    up = rotation_matrix(turn)[:, 2].astype(np.float32)
    model, state, work = stages(scene)
    x0 = state.x.numpy()
    x0[4:] += np.float32(2.0 * DEPTH) * up  # above each other by DEPTH

    def lowered(by: float) -> wp.array:
        x = x0.copy()
        x[4:] -= np.float32(by) * up
        return wp.array(x, dtype=wp.vec3)

    start = lowered(0.0)
    broad_phase.refresh(model, start, lowered(2.0 * DEPTH), work)
    narrow_phase.clear_places(work)
    found = []
    for by in np.arange(0.0, 1.6, 0.1) * DEPTH:
        narrow_phase.find_edges(model, start, lowered(by), work)
        found.append(int(work.narrow_phase.n_crossing.numpy()[0]))
    assert found[:10] == [0] * 10 and found[11:] == [2] * 5
    # New pairs are looked at at once, however far apart those before them were.
    for by, crossings in ((0.0, 0), (1.5, 2)):
        work.broad_phase.stale.fill_(1)
        x = lowered(by * DEPTH)
        broad_phase.refresh(model, x, lowered(2.0 * DEPTH), work)
        narrow_phase.clear_places(work)
        narrow_phase.find_edges(model, x, x, work)
        assert work.narrow_phase.n_crossing.numpy()[0] == crossings


def test_an_edge_that_begins_inside_is_led_out_of_the_part_that_it_enters_later(
    rng, stages, find_contacts, turned
):
    """From one prong of a body into the next by its top, and out of that by its end."""
    rotate = rotation_matrix(turn := turned())
    block = box((3.0, 1.0, 0.6), (3, 1, 3))
    middle = block.vertices[block.tets].mean(axis=1)
    kept = block.tets[(np.abs(middle[:, 2]) > 0.1) | (middle[:, 0] > 0.5)]
    used, tets = np.unique(kept, return_inverse=True)
    fork = TetMesh(block.vertices[used], tets.reshape(-1, 4))  # prongs above and below |z| = 0.1
    scene = Scene()
    scene.add_body(fork, RUBBER, rotation=turn)
    end, y = -0.1 - rng.uniform(0.11, 0.14), rng.uniform(-0.1, 0.1)  # where it leaves, at x = -1.5
    start, out = [0.3, y, 0.2], [-2.4, y, 0.2 + (end - 0.2) * 1.5]
    tip = TetMesh([start, out, [-0.9, 0.4, 2.0], [-0.9, -0.4, 2.0]], [[0, 1, 2, 3]])
    scene.add_body(tip, RUBBER, rotation=turn)
    model, state, work = stages(scene)
    c = find_contacts(model, work, state.x, edges=True)
    first = model.n_vert - 4
    (k,) = (k for k in range(c.n) if set(c.vert[k, :2]) == {first, first + 1})
    own = rotate.T @ (c.coef[k, :2] @ state.x.numpy()[c.vert[k, :2]])
    # At its deep end, or on the rim where the faces by which it comes and goes have one in common.
    up = rotate.T @ c.normal[k]
    assert -1.5 - 1e-5 < own[0] < -1.4 and up[2] > 0.9  # float32, over an edge of three metres
    assert own @ [0.0, 1.0, 0.0] == pytest.approx(y, abs=1e-5)
    assert 0.8 * (-0.1 - end) < c.depth[k] < -0.1 - end + 1e-5


@pytest.mark.parametrize("friction", [0.0, 1.0])
def test_sharp_wedges_hold_each_other_and_gain_no_energy(friction):
    """The middle of the inner piece is closer to the sides of a ridge than to it."""
    soft = NeoHookean(1e5, 0.4, 1000.0)
    scene = Scene(friction=friction)
    scene.add_body(wedge(), soft, fixed=True)
    half = 0.5**0.5
    scene.add_body(wedge(), soft, (0.0, 0.0, 1e-4), (half, half, 0.0, 0.0))  # upside down, across
    sim = Simulation(scene, fps=200)
    first = sim.measure()
    weight_height = sim.model.mass.numpy().sum() * 9.81 * 1.0
    for _ in sim.frames(30):
        now = sim.measure()
        # Symplectic Euler swings by its step; the wrong direction gave 0.6 and more.
        assert now.energy - first.energy < 1e-3 * weight_height
        assert now.overlap < 0.01 * sim.model.body_edge.numpy().min()
