"""Bodies of few tets: spikes, wedges, single tets, rings."""

import numpy as np

import warp_contact as wc

AS_IS = 0.0, 0.0, 0.0, 1.0  # quaternions (x, y, z, w)
UPSIDE_DOWN = 1.0, 0.0, 0.0, 0.0  # half a turn about x


def spike(height: float = 3.0) -> wc.TetMesh:
    """A pyramid on a square of edge 1, of two tets; its tip is at the origin and points up."""
    x = [[-0.5, -0.5, -height], [0.5, -0.5, -height], [0.5, 0.5, -height], [-0.5, 0.5, -height]]
    return wc.TetMesh([*x, [0.0, 0.0, 0.0]], [[0, 1, 2, 4], [0, 2, 3, 4]])


def wedge(height: float = 3.0) -> wc.TetMesh:
    """A prism on a base of 1 by 2, of three tets; its upper edge is the y axis about the origin."""
    x = [[s, y, -height if s else 0.0] for y in (-1.0, 1.0) for s in (-0.5, 0.5, 0.0)]
    return wc.TetMesh(x, [[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5]])


def tip(size: float = 1.0) -> wc.TetMesh:
    """A regular tet with one corner at the origin that points up."""
    across, height = size / np.sqrt(3.0), size * np.sqrt(2.0 / 3.0)
    angle = np.radians([0.0, 120.0, 240.0])
    base = np.stack([across * np.cos(angle), across * np.sin(angle), np.full(3, -height)], axis=1)
    return wc.TetMesh(np.concatenate([base, np.zeros((1, 3))]), [[0, 1, 2, 3]])


def ridge(size: float = 1.0) -> wc.TetMesh:
    """A regular tet whose upper edge runs along x through the origin."""
    half, down = 0.5 * size, -size / np.sqrt(2.0)
    x = [[-half, 0.0, 0.0], [half, 0.0, 0.0], [0.0, -half, down], [0.0, half, down]]
    return wc.TetMesh(x, [[0, 1, 2, 3]])


def ring(inner: tuple[float, float], outer: float, height: float, parts: int = 8) -> wc.TetMesh:
    """A ring about z with its upper face at z = 0; ``inner`` radii at the lower and upper face."""
    grid = wc.box(1.0, (parts, 1, 1))
    x, y, z = (grid.vertices + 0.5).T
    angle = 2.0 * np.pi * x
    r = np.where(y > 0.5, outer, np.where(z > 0.5, inner[1], inner[0]))
    rolled = np.stack([r * np.cos(angle), r * np.sin(angle), height * (z - 1.0)], axis=1)
    into = np.arange(len(x))
    into[x > 1.0 - 1e-9] = np.arange(4)  # the same vertices as the first four
    return wc.TetMesh(rolled[: len(x) - 4], into[grid.tets])
