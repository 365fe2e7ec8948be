"""Tets of the other volume cells that mesh files hold: hexes, prisms, pyramids, second order.

Of a cell of higher order only the corners count: its tet is the one that the mesher made before it
put nodes onto edges. To cut it at these nodes would keep curved sides, but would give eight tets
for one, half as large, that may be inverted.
"""

import numpy as np

CELLS = {  # first letters of meshio's names: number of corners, faces over them
    "tetra": (4, ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))),
    "pyramid": (5, ((0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4))),
    "wedge": (6, ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))),
    "hexahedron": (
        8,
        (
            (0, 1, 2, 3),
            (4, 5, 6, 7),
            (0, 1, 5, 4),
            (1, 2, 6, 5),
            (2, 3, 7, 6),
            (3, 0, 4, 7),
        ),
    ),
}


def kind(name: str) -> str | None:
    """The entry of ``CELLS`` for a meshio name such as ``tetra10``, None for other cells."""
    return next((k for k in CELLS if name.rstrip("0123456789") == k), None)


def tets_of(name: str, cells: np.ndarray) -> np.ndarray:
    """Tets of volume cells of one kind, shape (m, 4).

    Each cell is a cone from its corner of the lowest number over the faces that do not touch it;
    each face of four corners is cut from its own lowest number. Two cells cut the face that they
    share in the same way, whatever their kinds (Dompierre et al. 1999), so the tets conform.
    """
    corners, faces = CELLS[kind(name)]
    cells = cells[:, :corners]
    if corners == 4:
        return cells
    tip = cells.min(axis=1)
    parts = []
    for face in faces:
        far = cells[:, face]
        apart = (far != tip[:, None]).all(axis=1)
        far, top = far[apart], tip[apart, None]
        turn = far.argmin(axis=1)[:, None] + np.arange(len(face))
        far = np.take_along_axis(far, turn % len(face), axis=1)
        for k in range(1, len(face) - 1):
            parts.append(np.concatenate([top, far[:, [0, k, k + 1]]], axis=1))
    return np.concatenate(parts)
