"""output/self_overlap.py, and what measure() makes of it: bodies in themselves."""

import json

import numpy as np
import pytest

from warp_contact import (
    Corotated,
    NeoHookean,
    Scene,
    Simulation,
    SpringNetwork,
    TetMesh,
    box,
    sphere,
)
from warp_contact.command.run import line_of

SOFT = NeoHookean(1e5, 0.3, 1000.0, 2e-3)


def in_one(*parts: tuple[TetMesh, tuple]) -> TetMesh:
    """Meshes, each moved, as the pieces of one."""
    x, tets, n = [], [], 0
    for mesh, way in parts:
        x.append(mesh.vertices + np.asarray(way))
        tets.append(mesh.tets + n)
        n += len(mesh.vertices)
    return TetMesh(np.concatenate(x), np.concatenate(tets))


def at(mesh: TetMesh, x=None, *others: TetMesh) -> Simulation:
    """The mesh as body 'it', after bodies of other meshes far away, with its vertices put to x."""
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for k, other in enumerate(others):
        scene.add_body(other, SOFT, (10.0 * (k + 1), 0.0, 0.0))
    it = scene.add_body(mesh, SOFT, label="it")
    sim = Simulation(scene)
    if x is not None:
        sim.set_positions(it, x)
    return sim


def test_pieces_of_one_mesh_overlap_as_deep_as_bodies_do(rng, turned):
    depth = rng.uniform(0.02, 0.1)
    parts = (box(1.0, 2), (0.0, 0.0, 0.0)), (box(0.4, 3), (0.03, 0.02, 0.7 - depth))
    turn, way = turned(), rng.uniform(-1.0, 1.0, 3)
    mesh = in_one(*parts).transformed(np.eye(3), way)
    found = at(mesh, None, sphere(1.0, 41)).measure()
    # Lattices of 0.5 and 0.133 m: rounding of positions of 1 m.
    assert found.self_overlap == pytest.approx(depth, abs=1e-6)
    assert found.self_overlap_body == "it" and found.overlap == 0.0
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for part, way in parts:
        scene.add_body(part, SOFT, way, turn if way == (0.0, 0.0, 0.0) else (0.0, 0.0, 0.0, 1.0))
    assert Simulation(scene).measure().self_overlap == 0.0


@pytest.mark.parametrize("way", [(0.5, 0.0, 0.0), (0.5, 0.5, 0.5), (0.0, 0.0, 0.0)])
def test_pieces_whose_vertices_fall_together_are_seen(way):
    mesh = box(1.0, 2)
    now = at(in_one((mesh, (0.0, 0.0, 0.0)), (mesh, (3.0, 0.0, 0.0))))
    now.set_positions("it", np.concatenate([mesh.vertices, mesh.vertices + way]))
    assert now.measure().self_overlap > 0.4


@pytest.mark.parametrize("gap", [0.0, 1e-6, 1e-2])
def test_pieces_that_touch_do_not_overlap(gap, rng):
    for cells in (2, 3):
        mesh = in_one((box(1.0, 2), (0.0, 0.0, 0.0)), (box(1.0, cells), (0.0, 0.2, 1.0 + gap)))
        now = at(mesh.transformed(np.eye(3), rng.uniform(-3.0, 3.0, 3))).measure()
        assert now.self_overlap == 0.0 and now.self_overlap_body is None


def test_beams_of_one_mesh_that_cross_without_a_vertex_inside_are_seen(rng):
    beam, across = box((2.0, 0.2, 0.2), (2, 1, 1)), box((0.2, 2.0, 0.2), (1, 2, 1))
    depth = rng.uniform(0.02, 0.08)
    way = rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), 0.2 - depth
    now = at(in_one((beam, (0.3, 0.0, 0.0)), (across, way))).measure()
    # The middle of an inner piece: as deep as the beams are in each other.
    assert now.self_overlap == pytest.approx(depth, abs=1e-6)


def test_a_strip_rolled_up_into_itself_overlaps_and_one_bent_to_a_ring_does_not():
    mesh = box((1.0, 0.1, 0.02), (40, 4, 1))
    x, y, z = mesh.vertices.T
    for turns, folded in ((0.95, False), (1.1, True)):
        r, a = turns, 2.0 * np.pi * x * turns
        r = 1.0 / (2.0 * np.pi * turns) + z
        now = at(mesh, np.stack([r * np.sin(a), y, r * np.cos(a)], axis=1)).measure()
        assert now.inverted == 0 and (now.self_overlap > 0.0) == folded
        assert now.self_overlap < 0.0201  # its thickness, and rounding


def test_a_squeezed_body_does_not_overlap_itself(rng):
    for mesh in (sphere(0.05, 147), box(0.1, 3), box((0.3, 0.3, 0.01), (6, 6, 1))):
        for _ in range(6):
            turn, back = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
            squeeze = np.exp(rng.uniform(-4.0, 1.0, 3)) * np.sign(np.linalg.det(turn @ back))
            x = mesh.vertices @ turn.T * squeeze @ back.T + rng.uniform(-50.0, 50.0, 3)
            now = at(mesh, x * np.where(np.linalg.det(turn @ back) < 0.0, -1.0, 1.0)).measure()
            assert now.self_overlap == 0.0


def test_a_vertex_pushed_through_its_own_tets_counts_as_inverted_only():
    mesh = box(1.0, 4)
    x = mesh.vertices.copy()
    top = np.argmin(np.linalg.norm(x - [0.0, 0.0, 0.5], axis=1))
    x[top, 2] -= 0.4
    now = at(mesh, x).measure()
    assert now.inverted > 0 and now.self_overlap == 0.0


def test_parts_of_one_mesh_that_fall_through_each_other_are_told(rng):
    ball = sphere(0.03, 41)
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(in_one((ball, (0.0, 0.0, 0.03)), (ball, (0.003, 0.0, 0.1))), SOFT, label="two")
    sim = Simulation(scene)
    assert sim.measure().self_overlap == 0.0
    for _ in sim.frames(12):
        now = sim.measure()
    assert now.self_overlap > 0.01 and now.self_overlap_body == "two"
    line = json.loads(line_of(sim, now))
    assert line["self_overlap"] == now.self_overlap and line["self_overlap_body"] == "two"


@pytest.mark.parametrize(
    "material",
    [
        SOFT,
        Corotated(1e5, 0.3, 1000.0, 2e-3),
        SpringNetwork(0.05, 0.05, 0.05, 1000.0, 2e-3),
    ],
)
def test_a_block_pressed_inside_out_recovers_or_is_told_to_be_folded(material, rng):
    for cells in (2, 3):
        scene = Scene(gravity=(0.0, 0.0, 0.0))
        mesh = box(0.1, cells)
        scene.add_body(mesh, material)
        sim = Simulation(scene)
        crushed = mesh.vertices * [1.0, 1.0, -0.3]
        sim.set_positions(0, crushed + rng.normal(0.0, 1e-3 / cells, crushed.shape))
        assert sim.measure().inverted == len(mesh.tets)
        for _ in sim.frames(40):
            pass
        now = sim.measure()
        # Springs ring longer; a fold keeps tets below a fifth of their volume.
        assert now.volume_ratio > 0.5 or now.inverted or now.self_overlap > 1e-3
