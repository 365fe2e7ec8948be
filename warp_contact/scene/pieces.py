"""Pieces of a mesh, and the seams along which it may be meant to hang together."""

import numpy as np

from warp_contact.scene.topology import MeshError

SEAM = 1e-6  # mean edges: vertices nearer than that are in the same place
CROWD = 100  # vertices in one place: more are no seam


def components(pairs: np.ndarray, n: int) -> np.ndarray:
    """The lowest vertex that each of ``n`` vertices is joined to by the pairs, shape (n,)."""
    label = np.arange(n)
    if not len(pairs):
        return label
    p, q = pairs.T
    while True:
        a, b = label[p], label[q]
        apart = a != b
        if not apart.any():
            return label
        np.minimum.at(label, np.maximum(a, b)[apart], np.minimum(a, b)[apart])
        while (label[label] != label).any():
            label = label[label]


def coincident(x: np.ndarray, tolerance: float) -> np.ndarray:
    """Pairs p < q of points [m] not further apart than a tolerance [m], ascending, shape (k, 2).

    Of eight grids, shifted by half a cell, one has both points of any pair in one cell.

    Raises:
        MeshError: a cell holds more than ``CROWD`` points
    """
    keys = [np.zeros(0, dtype=np.int64)]
    for shift in np.ndindex(2, 2, 2):
        cell = np.floor((x - x.min(axis=0)) / (2.0 * tolerance) + 0.5 * np.array(shift))
        order = np.lexsort(cell.T)
        for k in range(1, len(x)):
            p, q = order[:-k], order[k:]
            same = (cell[p] == cell[q]).all(axis=1)
            if not same.any():
                break
            if k == CROWD:
                raise MeshError(
                    f"more than {CROWD} vertices are within {2.0 * tolerance:g} m: "
                    f"give a smaller tolerance"
                )
            p, q = p[same], q[same]
            near = np.linalg.norm(x[p] - x[q], axis=1) <= tolerance
            keys.append(np.minimum(p, q)[near] * len(x) + np.maximum(p, q)[near])
    key = np.unique(np.concatenate(keys))
    return np.stack([key // len(x), key % len(x)], axis=1)


def welded(x: np.ndarray, tets: np.ndarray, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and tets with one vertex, the first, for each group that the pairs join.

    Raises:
        MeshError: two corners of a tet would become one
    """
    first = components(pairs, len(x))
    new = first[tets]
    flat = np.flatnonzero((np.diff(np.sort(new, axis=1), axis=1) == 0).any(axis=1))
    if len(flat):
        raise MeshError(
            f"tet {flat[0]} would lose its volume: its corners are nearer than the tolerance; "
            f"give a smaller one"
        )
    kept, tets = np.unique(new, return_inverse=True)
    return x[kept], tets.reshape(-1, 4)
