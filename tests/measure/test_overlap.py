"""output/measure.py: how deep bodies are in each other."""

import numpy as np
import pytest

from warp_contact import NeoHookean, Scene, Simulation, TetMesh, box

SOFT = NeoHookean(1e5, 0.3, 1000.0)


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
