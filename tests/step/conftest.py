"""What tests of the broad and the narrow phase share: what lies in what, by brute force."""

import numpy as np
import pytest

from warp_contact import Scene

# float32 weights of the tets of the tests (edges of 0.1 to 1, coordinates below 10) are good to
# this; pairs that are closer to a face are left to rounding.
DOUBT = 1e-3
MARGIN = 0.02  # weight that the speculative margin, 1e-3 of an edge, may reach in a flat tet


def _weights(x: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Barycentric weights of all points in all tets, shape (n, m, 4)."""
    inverse = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    w = np.einsum("mij,nmj->nmi", inverse, x[:, None] - corners[None, :, 0])
    return np.concatenate([1.0 - w.sum(axis=2, keepdims=True), w], axis=2)


def _brute_force(scene: Scene, x: np.ndarray) -> tuple[set, set]:
    """(vertex, body) pairs that are certain, and those that are near a face."""
    sure, doubtful = set(), set()
    first = np.cumsum([0] + [len(b.x) for b in scene.bodies])
    for body, i0, i1 in zip(scene.bodies, first, first[1:], strict=False):
        margin = _weights(x, x[i0:i1][body.mesh.tets]).min(axis=2).max(axis=1)
        for other, j0, j1 in zip(scene.bodies, first, first[1:], strict=False):
            if other is not body and other.world == body.world:
                for i in range(j0, j1):
                    if margin[i] > DOUBT:
                        sure.add((i, body.index))
                    elif margin[i] > -MARGIN:
                        doubtful.add((i, body.index))
    return sure, doubtful


@pytest.fixture
def brute_force():
    """Vertices in bodies, ``brute_force(scene, x)``: pairs that are certain, and doubtful ones."""
    return _brute_force
