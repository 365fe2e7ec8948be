"""measure.py: overlaps, what is not held or inside out, and energies, of states set by hand."""

import numpy as np
import pytest

from warp_contact import NeoHookean, Scene, Simulation, TetMesh, box
from warp_contact.scene.scene import rotation_matrix

SOFT = NeoHookean(1e5, 0.3, 1000.0)
TIP = TetMesh(
    [[0.0, 0.0, 0.0], [0.3, 0.0, 2.0], [-0.2, 0.3, 2.0], [-0.2, -0.3, 2.0]], [[0, 1, 2, 3]]
)


@pytest.mark.parametrize("plane", [False, True])
def test_the_overlap_of_a_vertex_is_its_way_to_the_surface(rng, turned, plane):
    """Of a tip in a block; it counts less than being below a plane by more."""
    rotate = rotation_matrix(turn := turned())
    depth, below = rng.uniform(0.05, 0.2, 2) + [0.0, 0.2]
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(box(2.0, 3), SOFT, rotation=turn, label="block")
    place = rotate @ (*rng.uniform(-0.3, 0.3, 2), 1.0 - depth)
    scene.add_body(TIP, SOFT, place, turn, label="tip")
    if plane:  # it holds the block, but not the tip
        scene.add_plane(rotate @ (0.0, 0.0, -1.0), -(1.0 - depth + 2.0 - below))
    now = Simulation(scene).measure()
    # Coordinates of order 1 in float32.
    assert now.overlap == pytest.approx(below if plane else depth, abs=2e-6)
    assert now.overlap_pair == ("tip", "plane0" if plane else "block")


def test_the_first_tet_of_a_scene_counts_like_any_other(rng):
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    wide = TetMesh([[-3, -3, 0], [3, -3, 0], [0, 4, 0], [0, 0, -5]], [[0, 2, 1, 3]])
    scene.add_body(wide, SOFT)
    depth = rng.uniform(0.05, 0.2)
    scene.add_body(TIP, SOFT, (*rng.uniform(-0.3, 0.3, 2), -depth))
    assert Simulation(scene).measure().overlap == pytest.approx(depth, abs=2e-6)  # float32


def test_the_overlap_of_crossed_ridges_is_that_of_the_piece_inside(rng, turned):
    """No vertex is inside: the middle of the piece of an edge is, and how far its nearest side."""
    rotate = rotation_matrix(turn := turned())
    depth = rng.uniform(0.02, 0.1)
    ridge = [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, -0.5, -0.4], [0.0, 0.5, -0.4]]
    across = [[-y, x, -z] for x, y, z in ridge]
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(TetMesh(ridge, [[0, 1, 2, 3]]), SOFT, rotation=turn)
    scene.add_body(TetMesh(across, [[0, 1, 2, 3]]), SOFT, rotate @ (0.0, 0.0, -depth), turn)
    overlap = Simulation(scene).measure().overlap
    assert overlap == pytest.approx(depth * 0.5 / np.hypot(0.5, 0.4), abs=2e-6)


def test_a_body_that_is_lifted_gains_its_weight_times_the_height(rng):
    scene = Scene(gravity=(0.3, 0.0, -9.81))
    scene.add_body(box(0.1, 2), SOFT)
    sim = Simulation(scene)
    before, way = sim.measure(), rng.uniform(-1.0, 1.0, 3)
    sim.set_positions(0, sim.positions(0) + np.float32(way))
    after = sim.measure()
    gained = after.gravitational - before.gravitational
    # One kilogram, and positions of order 1 in float32.
    assert gained == pytest.approx(9.81 * way[2] - 0.3 * way[0], abs=1e-5)


def test_tets_turned_inside_out_are_counted(rng):
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    mesh = box(1.0, 3)
    scene.add_body(mesh, SOFT)
    sim = Simulation(scene)
    assert sim.measure().inverted == 0
    x = sim.positions() + rng.normal(0.0, 0.2, (len(mesh.vertices), 3))
    sim.state.x.assign(x.astype(np.float32))
    corner = np.moveaxis(sim.positions().astype(float)[mesh.tets], 1, 0)
    volume = np.linalg.det(np.stack([c - corner[0] for c in corner[1:]], axis=1))
    now = sim.measure()
    assert now.inverted == int((volume <= 0.0).sum()) > 0
    assert (now.volume_ratio <= 0.0) == (now.inverted > 0)


def one_over_another(way) -> Simulation:
    """A block of 16 vertices a face centred over one of 9, 0.05 m above it but for ``way``."""
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(box(1.0, 2), SOFT)
    scene.add_body(box(0.5, 3), SOFT, np.add((0.0, 0.0, 0.8), way))
    return Simulation(scene)


def test_a_vertex_in_another_body_without_a_contact_is_unheld(rng):
    sim = one_over_another((0.0, 0.0, 0.0))
    sim.step_frame()
    assert sim.measure().unheld == 0
    x = sim.positions()
    x[27:] += np.float32([*rng.uniform(-0.05, 0.05, 2), -0.05 - rng.uniform(0.02, 0.1)])
    sim.state.x.assign(x)
    # The lower face of the upper body, and the middle of the upper face of the lower one.
    assert sim.measure().unheld == 16 + 1


def test_a_step_holds_what_overlaps_from_the_start(rng):
    sim = one_over_another((*rng.uniform(-0.05, 0.05, 2), -0.05 - rng.uniform(0.02, 0.1)))
    assert sim.measure().overlap > 0.0
    sim.step_frame()
    assert sim.measure().unheld == 0


def test_nothing_is_unheld_before_the_first_step():
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for z in (0.0, 0.7):
        scene.add_body(box(1.0, 2), SOFT, (0.0, 0.01, z))
    now = Simulation(scene).measure()
    assert now.overlap > 0.0 and now.unheld == 0


def test_a_vertex_on_the_faces_of_tets_is_inside_whatever_rounding_says(rng):
    tip = TetMesh([[0, 0, 0], [-0.2, 0, 1], [0.2, -0.2, 1], [0.2, 0.2, 1]], [[0, 1, 3, 2]])
    for _ in range(40):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn *= np.linalg.det(turn)
        depth = rng.uniform(0.02, 0.2)
        scene = Scene(gravity=(0.0, 0.0, 0.0))
        scene.add_body(box(1.0, 2).transformed(turn, np.zeros(3)), SOFT)
        where = turn @ [0.0, 0.0, 0.5 - depth]  # on the axis of the block: where tets meet
        scene.add_body(tip.transformed(turn, np.zeros(3)), SOFT, where)
        # Rounding of positions of 1 m.
        assert Simulation(scene).measure().overlap == pytest.approx(depth, abs=1e-6)
