"""cells.py: other volume cells become tets that conform."""

import numpy as np
import pytest

from warp_contact.scene.cells import CELLS, kind, tets_of
from warp_contact.scene.mesh import TetMesh

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
CUBE = np.concatenate([CUBE, CUBE + [0, 0, 1]])  # in the order of VTK


def grid(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and hexes of n^3 unit cubes."""
    x = np.stack(np.meshgrid(*[np.arange(n + 1)] * 3, indexing="ij"), -1).reshape(-1, 3)
    first = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 1, 3)
    return x.astype(float), (first + CUBE) @ [(n + 1) ** 2, n + 1, 1]


def test_hexes_become_tets_that_conform_whatever_their_numbers(rng):
    x, hexes = grid(3)
    place = rng.permutation(len(x))
    y = np.empty_like(x)
    y[place] = x
    tets = tets_of("hexahedron", place[hexes])
    mesh = TetMesh(y, tets)  # refuses faces that do not fit
    # Sums of 162 equal terms.
    assert mesh.volume == pytest.approx(27.0, rel=1e-13)
    assert len(mesh.tets) == 6 * 27 and len(mesh.surface) == 2 * 6 * 9
    assert mesh.n_pieces == 1


def test_cells_of_several_kinds_fit_each_other(rng):
    """A cube, a prism and a pyramid on two of its faces."""
    x = np.concatenate([CUBE, [[2.0, 0.5, 0.0], [2.0, 0.5, 1.0], [0.5, 0.5, 2.0]]]).astype(float)
    place = rng.permutation(len(x))
    y = np.empty_like(x)
    y[place] = x
    cells = {
        "hexahedron": [[0, 1, 2, 3, 4, 5, 6, 7]],
        "wedge": [[1, 8, 2, 5, 9, 6]],
        "pyramid": [[4, 5, 6, 7, 10]],
    }
    tets = [tets_of(name, place[np.array(cell)]) for name, cell in cells.items()]
    assert [len(t) for t in tets] == [6, 3, 2]
    mesh = TetMesh(y, np.concatenate(tets))
    assert mesh.volume == pytest.approx(1.0 + 0.5 + 1.0 / 3.0, rel=1e-13)  # a handful of roundings


def test_of_cells_of_second_order_the_corners_are_taken():
    ten = np.arange(10)[None]
    np.testing.assert_array_equal(tets_of("tetra10", ten), [[0, 1, 2, 3]])
    twenty = np.arange(20)[None]
    np.testing.assert_array_equal(
        tets_of("hexahedron20", twenty), tets_of("hexahedron", twenty[:, :8])
    )


def test_only_volume_cells_have_a_kind():
    assert [kind(name) for name in ("tetra", "tetra10", "wedge15")] == ["tetra", "tetra", "wedge"]
    assert [kind(name) for name in ("triangle", "quad9", "vertex", "tetrahedra")] == [None] * 4
    for corners, faces in CELLS.values():
        assert {i for face in faces for i in face} == set(range(corners))
