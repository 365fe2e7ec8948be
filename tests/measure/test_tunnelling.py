"""output/tunnelling.py, and what measure() makes of it: what went through what, moved by hand."""

import json
from itertools import pairwise

import numpy as np
import pytest
import warp as wp

from warp_contact import NeoHookean, Scene, Simulation, SimulationError, TetMesh, box
from warp_contact.command.metrics import line_of
from warp_contact.kernels.output import tunnelling
from warp_contact.scene.scene import rotation_matrix

SOFT = NeoHookean(1e5, 0.3, 1000.0)
PLATE = 2.0, 2.0, 0.1  # [m]
BLOCK = 0.3  # edge [m]


def over_a_plate(turn=(0.0, 0.0, 0.0, 1.0), height: float = 0.4) -> Simulation:
    """A block above a plate of few points, measured once."""
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(box(PLATE, (2, 2, 1)), SOFT, label="plate")
    scene.add_body(box(BLOCK, 2), SOFT, (0.31, 0.27, height), turn, label="block")
    sim = Simulation(scene)
    sim.measure()
    return sim


def points(sim: Simulation, body: int) -> int:
    """Surface vertices and surface edges of a body."""
    of = sim.model.vert_body.numpy()
    found = of[sim.model.surf.numpy()] == body, of[sim.model.edges.numpy()[:, 0]] == body
    return sum(int(which.sum()) for which in found)


def move(sim: Simulation, way, body: int | None = 1) -> None:
    """Displace a body, or all, and look."""
    x = sim.positions()
    x[sim._bodies.range(body)] += np.float32(way)
    place(sim, x)


def place(sim: Simulation, x: np.ndarray) -> None:
    """Set the positions and look."""
    sim.state.x.assign(x.astype(np.float32))
    sim.measure()


def affine(rng) -> tuple[np.ndarray, np.ndarray]:
    """A map of space that mixes rotation, shear and stretch, and is not far from the identity."""
    return np.eye(3) + 0.2 * rng.uniform(-1.0, 1.0, (3, 3)), rng.uniform(-3.0, 3.0, 3)


def test_every_point_of_a_block_that_drops_through_a_plate_counts_once(turned, rng):
    sim = over_a_plate(turned())
    move(sim, (*rng.uniform(-0.2, 0.2, 2), -0.9))
    now = sim.measure()
    assert now.tunnelled >= points(sim, 1)  # and those of the plate that the block swept over
    assert now.tunnelled <= points(sim, 1) + points(sim, 0)
    assert set(now.tunnelled_pair) == {"block", "plate"}
    assert sim.measure().tunnelled == now.tunnelled


def test_the_number_of_looks_does_not_matter(turned, rng):
    turn, way = turned(), np.array([*rng.uniform(-0.2, 0.2, 2), -0.9])
    found = []
    for looks in (1, 2, 7, 40):
        sim = over_a_plate(turn)
        for _ in range(looks):
            move(sim, way / looks)
        found.append(sim.measure().tunnelled)
    # A point on its way along an edge may be missed once the way is cut there.
    np.testing.assert_allclose(found, found[0], atol=2)


def test_a_point_counts_in_any_frame_that_moves_and_stretches(turned, rng):
    sim = over_a_plate(turned())
    x = sim.positions().astype(float)
    x[sim._bodies.range(1)] += [0.0, 0.0, -0.9]
    a, b = affine(rng)
    place(sim, x @ a.T + b)
    assert sim.measure().tunnelled >= points(sim, 1)


def test_what_moves_alike_does_not_pass(turned, rng):
    sim = over_a_plate(turned())
    start = sim.positions().astype(float)
    for _ in range(10):
        a, b = affine(rng)
        place(sim, start @ a.T + b)
    assert sim.measure().tunnelled == 0


@pytest.mark.parametrize("looks", [1, 6])
def test_a_point_that_enters_again_within_a_look_is_inside(rng, turned, looks):
    """Through one prong of a body into the next: it has passed once, and is yet to pass again."""
    rotate = rotation_matrix(turn := turned())
    block = box((3.0, 1.0, 0.6), (3, 1, 3))
    middle = block.vertices[block.tets].mean(axis=1)
    kept = block.tets[(np.abs(middle[:, 2]) > 0.1) | (middle[:, 0] > 0.5)]
    used, tets = np.unique(kept, return_inverse=True)
    fork = TetMesh(block.vertices[used], tets.reshape(-1, 4))  # prongs above and below |z| = 0.1
    tip = TetMesh([[0, 0, 0], [0.1, 0, 2.0], [-0.1, 0.1, 2.0], [-0.1, -0.1, 2.0]], [[0, 1, 2, 3]])
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(fork, SOFT, rotation=turn, label="fork")
    height = rng.uniform(0.4, 0.5)
    place = (rng.uniform(-1.2, -0.3), rng.uniform(-0.3, 0.3), height)
    scene.add_body(tip, SOFT, rotate @ place, turn, label="tip")
    sim = Simulation(scene)
    sim.measure()
    passed = []
    for way in (height + 0.2, 0.4):  # into the middle of the lower prong, and out of it
        for _ in range(looks):
            move(sim, -way / looks * rotate[:, 2])
        passed.append(sim.measure().tunnelled)
    # The vertex of the tip; the middles of its edges are still above.
    assert passed == [1, 2]


def test_in_and_out_by_the_same_face_is_no_passing(turned, rng):
    sim = over_a_plate(turned())
    low = sim.positions(1)[:, 2].min() - 0.05
    deep = low + rng.uniform(0.02, 0.08)
    for way in (-deep, deep):
        move(sim, (0.0, 0.0, way))
    assert sim.measure().tunnelled == 0


def test_a_block_that_passes_round_the_rim_does_not_pass_through(turned):
    sim = over_a_plate(turned())
    for way in ((1.5, 0.0, 0.0), (0.0, 0.0, -0.9), (-1.5, 0.0, 0.0)):
        move(sim, way)
        assert sim.measure().overlap == 0.0
    assert sim.measure().tunnelled == 0


@pytest.mark.parametrize("looks", [1, 5])
def test_a_vertex_that_grazes_a_base_from_rim_to_rim_does_not_go_through(looks, rng):
    for part, through in ((0.09, False), (0.11, True)):
        scene = Scene(gravity=(0.0, 0.0, 0.0))
        scene.add_body(box(1.0, 2), SOFT, label="cube")
        tip = TetMesh([[0, 0, 0], [-1, 0, -3], [1, -1, -3], [1, 1, -3]], [[0, 1, 3, 2]])
        depth = part * 2.0 / 6.0  # of its thickness, twice the volume over the surface
        y = rng.uniform(-0.25, 0.25)
        scene.add_body(tip, SOFT, (-0.7, y, depth - 0.5), label="tip")
        sim = Simulation(scene)
        sim.measure()
        for _ in range(looks):
            move(sim, (1.4 / looks, 0.0, 0.0))
        now = sim.measure()
        assert (now.tunnelled > 0) == through


def test_a_plate_that_bends_away_from_a_block_lets_nothing_through(rng):
    sim = over_a_plate(height=0.3)
    start = sim.positions().astype(float)
    for _ in range(10):
        bend = 0.1 * rng.uniform(-1.0, 1.0, 3)
        z = bend[0] * start[:, 0] ** 2 + bend[1] * start[:, 1] ** 2 + 10.0 * bend[2]
        place(sim, start + z[:, None] * [0.0, 0.0, 1.0])
    assert sim.measure().tunnelled == 0


def test_beams_that_cross_without_a_vertex_in_the_other_are_seen():
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(box((2.0, 0.3, 0.1), (2, 1, 1)), SOFT, label="along")
    scene.add_body(box((0.3, 2.0, 0.1), (1, 2, 1)), SOFT, (0.0, 0.0, 0.2), label="across")
    sim = Simulation(scene)
    sim.measure()
    move(sim, (0.0, 0.0, -0.4))
    assert sim.measure().tunnelled > 0


def test_points_deeper_below_a_plane_than_their_body_is_thick_count_once():
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(box(BLOCK, 2), SOFT, (0.0, 0.0, BLOCK), label="block")
    sim = Simulation(scene)
    sim.measure()
    thick = float(sim.model.body_thickness.numpy()[0])
    move(sim, (0.0, 0.0, -0.5 * BLOCK - 0.99 * thick), 0)
    assert sim.measure().tunnelled == 0
    move(sim, (0.0, 0.0, -BLOCK - 0.02 * thick), 0)
    assert sim.measure().tunnelled == points(sim, 0)
    assert sim.measure().tunnelled_pair == ("block", "plane0")
    move(sim, (0.0, 0.0, -1.0), 0)
    assert sim.measure().tunnelled == points(sim, 0)


def test_worlds_pass_through_each_other_freely():
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for world in (0, 1):
        scene.add_body(box(BLOCK, 1), SOFT, (0.0, 0.0, world), world=world)
    sim = Simulation(scene)
    sim.measure()
    move(sim, (0.0, 0.0, -2.0))
    assert sim.measure().tunnelled == 0


def test_crossing_times_are_the_roots_of_the_cubic_within_the_triangle(rng):
    crossed = 0
    for _ in range(60):
        ends = rng.uniform(-1.0, 1.0, (2, 4, 3))
        s, weights = rng.uniform(0.1, 0.9), rng.dirichlet(np.ones(3))
        meet = weights @ ((1.0 - s) * ends[0, 1:] + s * ends[1, 1:])
        ends[1, 0] = (meet - (1.0 - s) * ends[0, 0]) / s
        u, v, w = ((ends[:, k] - ends[:, 1]).astype(np.float32) for k in (0, 2, 3))
        r = tunnelling.Relative()
        for name, end in (("u", u), ("v", v), ("w", w)):
            setattr(r, f"{name}0", wp.vec3(*end[0].tolist()))
            setattr(r, f"{name}1", wp.vec3(*end[1].tolist()))
        stops = [0.0, *tunnelling.turning(r), 1.0]
        found = [tunnelling.crossing_time(r, a, b) for a, b in pairwise(stops)]
        found = [s for s in found if s <= 1.0]
        # What is closer than this to a rim, of the triangle or of the time, may fall either way.
        sure = roots(u, v, w, 1e-3)
        perhaps = roots(u, v, w, -1e-3)
        for s in sure:
            assert np.abs(np.subtract(found, s)).min(initial=1.0) < 1e-3
        for s in found:
            assert np.abs(np.subtract(perhaps, s)).min(initial=1.0) < 1e-3
        crossed += len(sure)
    assert crossed > 30


def roots(u, v, w, margin: float) -> list[float]:
    """When a point crosses a triangle, by NumPy; by ``margin`` within it and within the time.

    Where it only touches the plane, two crossings a ``margin`` apart may also be none.
    """
    s = np.linspace(0.0, 1.0, 4)
    at = [(np.outer(1.0 - s, e[0]) + np.outer(s, e[1])) for e in (u, v, w)]
    f = np.einsum("ki,ki->k", at[0], np.cross(at[1], at[2]))
    kept = []
    found = np.roots(np.polyfit(s, f, 3))
    for k, root in enumerate(found):
        alone = np.abs(np.delete(found, k) - root).min() > margin
        if alone and abs(root.imag) < 1e-9 and margin < root.real < 1.0 - margin:
            p, b, c = ((1.0 - root.real) * e[0] + root.real * e[1] for e in (u, v, w))
            weights = np.linalg.lstsq(np.stack([b, c], axis=1), p, rcond=None)[0]
            if min(*weights, 1.0 - weights.sum()) > margin:
                kept.append(float(root.real))
    return kept


def test_a_line_of_metrics_tells_what_went_through(rng):
    sim = over_a_plate()
    move(sim, (*rng.uniform(-0.2, 0.2, 2), -0.9))
    line = json.loads(line_of(sim, sim.measure()))
    assert line["tunnelled"] > 0 and line["tunnelled_pair"] == ["block", "plate"]
    assert line["inverted"] == line["unheld"] == 0


@pytest.mark.parametrize("speed", [5.0, 16.0])
def test_one_step_too_long_is_refused_and_many_short_ones_stop_the_block(speed):
    stiff = NeoHookean(1e6, 0.3, 1000.0)
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(box((0.1, 0.1, 0.002), (3, 3, 1)), stiff, fixed=True)
    start = 0.011 + 0.75 * speed / 400.0
    scene.add_body(box(0.02, 2), stiff, (0.003, 0.002, start), velocity=(0.0, 0.0, -speed))
    with pytest.raises(SimulationError, match="frame 1: substeps=1 is too few: a step"):
        Simulation(scene, fps=400, substeps=1).step_frame()
    sim = Simulation(scene, fps=400)
    sim.measure()
    for _ in sim.frames(3):
        now = sim.measure()
    assert now.tunnelled == 0
