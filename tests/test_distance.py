"""tools/chart/distance.py: the distance of two surfaces, against exact and sampled ones."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

from chart import distance as surfaces


def distance(xa, xb) -> float:
    """Of two surfaces of one triangle each."""
    tri = np.array([[0, 1, 2]])
    return surfaces.distance(np.array(xa), tri, np.array(xb), tri)


FLAT = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
PAIRS = {  # second triangle, distance from FLAT
    "a vertex above the inside": ([[0.2, 0.2, 0.3], [0.2, 1.0, 2.0], [1.0, 0.2, 2.0]], 0.3),
    "a vertex beside an edge": ([[0.5, -0.4, 0.0], [0.5, -2.0, 1.0], [0.6, -2.0, -1.0]], 0.4),
    "edges that pass each other": ([[0.5, -1.0, -0.9], [0.5, -1.0, 1.1], [0.5, -2.0, 0.0]], 1.0),
    "a crossed one above": ([[0.5, -0.5, 0.2], [0.5, 0.5, 0.2], [0.5, 0.0, 2.0]], 0.2),
    "parallel edges": ([[0.2, -0.3, 0.0], [0.8, -0.3, 0.0], [0.5, -1.0, 1.0]], 0.3),
    "one that goes through": ([[0.2, 0.2, 0.3], [0.2, 0.2, -0.3], [0.9, 0.9, 0.3]], 0.0),
    "one apart in its own plane": ([[3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [3.0, 1.0, 0.0]], 2.0),
}


@pytest.mark.parametrize("case", PAIRS)
def test_the_distance_of_two_triangles(case):
    other, exact = PAIRS[case]
    # Double precision on coordinates of order 1.
    assert distance(FLAT, other) == pytest.approx(exact, abs=1e-14)
    assert distance(other, FLAT) == pytest.approx(exact, abs=1e-14)


def test_the_distance_of_triangles_is_that_of_their_points(rng):
    weights = np.array([(i, j, 40 - i - j) for i in range(41) for j in range(41 - i)]) / 40.0
    for _ in range(20):
        a, b = rng.uniform(-1.0, 1.0, (2, 3, 3))
        sampled = np.linalg.norm((weights @ a)[:, None] - weights @ b, axis=2).min()
        exact = distance(a, b)
        # Each of the two nearest points has one of the samples within a cell, an edge over 40; no
        # edge is longer than the diagonal of the cube that they are drawn from.
        assert exact <= sampled + 1e-14
        assert exact >= sampled - 2.0 * np.sqrt(12.0) / 40.0
