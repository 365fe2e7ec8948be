"""Rest shapes in closed form: the same arguments give the same mesh on every machine."""

from functools import cache
from itertools import combinations

import numpy as np

from warp_contact import checks
from warp_contact.scene.mesh import TetMesh

EVEN = np.array(  # a cube in 5 tets: the corners of even parity carry the middle one
    [[0, 3, 5, 6], [1, 0, 3, 5], [2, 0, 6, 3], [4, 0, 5, 6], [7, 3, 6, 5]]
)  # corner x + 2 y + 4 z
ODD = EVEN ^ 1  # mirrored in x
CELLS, BALL = 10_000_000, 200_000  # cells, vertices of a ball: more take all memory


def _length(value, name: str) -> float:
    """A length [m] above zero that a body can have."""
    return checks.number(value, name, 1e-9, 1e9)


def _three(value) -> list:
    """One value for all three axes, or three."""
    array = checks.array_of(value)
    if array.ndim == 0:
        return [value] * 3
    if len(array) != 3:
        raise checks.refuse("size or cells", value, "one number or three")
    return list(value)


def box(size, cells, mirrored: bool = False) -> TetMesh:
    """A block of edges ``size`` [m] about the origin, split into ``cells``; one number or three.

    Each cell is cut into five tets. The cut alternates between a cell and its neighbours like the
    colours of a chess board, so that the mesh conforms. No diagonal runs in the same direction
    everywhere, so a block of a few cells has no preferred direction. The usual six tets about one
    space diagonal have one. ``mirrored`` swaps the two colours.
    """
    size = [_length(s, "size") for s in _three(size)]
    n = [checks.count(k, "cells", most=CELLS) for k in _three(cells)]
    checks.flag(mirrored, "mirrored")
    if np.prod(n, dtype=float) > CELLS:
        raise checks.refuse("cells", cells, f"fewer: {CELLS} in all at most")
    axis = [np.linspace(-0.5 * s, 0.5 * s, k + 1) for s, k in zip(size, n, strict=True)]
    vertices = np.stack(np.meshgrid(*axis, indexing="ij"), axis=-1).reshape(-1, 3)
    cell = np.stack(np.meshgrid(*map(np.arange, n), indexing="ij"), axis=-1).reshape(-1, 3)
    corner = np.arange(8)[:, None] >> np.arange(3) & 1
    stride = np.array([(n[1] + 1) * (n[2] + 1), n[2] + 1, 1])
    ids = (cell[:, None] + corner) @ stride
    odd = (cell.sum(axis=1) + mirrored) % 2 == 1
    tets = np.where(odd[:, None, None], ids[:, ODD], ids[:, EVEN])
    return TetMesh(vertices, tets.reshape(-1, 4))


def sphere(radius: float, vertices: int = 41) -> TetMesh:
    """A ball about the origin, its surface vertices at ``radius`` [m].

    Of the sizes on offer the one nearest to ``vertices`` is taken: 13, 41, 55, 147, 309, 561, 923,
    1415, 2057, ... The one of 41 has 37 vertices and 70 triangles on its surface. The others are an
    icosahedron of 20 regular tets, each refined n times and blown up shell by shell.
    """
    radius, vertices = _length(radius, "radius"), checks.count(vertices, "vertices", most=BALL)
    n = 1
    while abs(_shell_count(n + 1) - vertices) < abs(_shell_count(n) - vertices):
        n += 1
    coarse = abs(41 - vertices) < abs(_shell_count(n) - vertices)
    x, tets = _coarse_ball() if coarse else _icosahedral_ball(n)
    return TetMesh(radius * x, tets)


def cylinder(radius: float, height: float, rings: int = 2, layers: int | None = None) -> TetMesh:
    """A cylinder about the z axis and the origin, ``radius`` and ``height`` in [m].

    Discs of ``rings`` hexagonal rings of vertices, ``layers`` of prisms between them (as many as
    make them about as high as wide), each prism in three tets.
    """
    radius, height = _length(radius, "radius"), _length(height, "height")
    if layers is None:
        layers = max(1, round(height * checks.count(rings, "rings", most=CELLS) / radius))
    rho, theta, zeta, tets = drum(rings, layers)
    across = radius * rho
    z = height * (zeta - 0.5)
    return TetMesh(np.stack([across * np.cos(theta), across * np.sin(theta), z], axis=1), tets)


def dish(radius: float, depth: float, thickness: float, rings: int = 8, layers: int = 1) -> TetMesh:
    """A bowl that opens upwards: the cap of a spherical shell, closed all around.

    ``radius`` [m] is that of the inner rim and ``depth`` [m] that of the hollow; the wall of
    ``thickness`` [m] lies outside of it. The axis is z, the lowest point of the outside is at 0.
    """
    radius, depth = _length(radius, "radius"), _length(depth, "depth")
    thickness = _length(thickness, "thickness")
    curve = 0.5 * (radius**2 + depth**2) / depth
    rho, theta, zeta, tets = drum(rings, layers)
    polar = rho * 2.0 * np.arctan2(depth, radius)
    r = curve + thickness * zeta
    across = r * np.sin(polar)
    z = curve + thickness - r * np.cos(polar)
    return TetMesh(np.stack([across * np.cos(theta), across * np.sin(theta), z], axis=1), tets)


def drum(rings: int, layers: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Cylindrical coordinates of vertices, rho and zeta in 0..1 and theta [rad], and their tets.

    A body with an axis is a map of these: a cylinder, a dish, a capsule.
    """
    rings = checks.count(rings, "rings", most=CELLS)
    layers = checks.count(layers, "layers", most=CELLS)
    if 6.0 * rings**2 * layers > CELLS:
        raise checks.refuse("rings and layers", (rings, layers), f"fewer: {CELLS} prisms at most")
    rho, theta, colour, triangles = _disc(rings)
    n = len(rho)
    order = np.argsort(colour[triangles], axis=1)
    low = np.take_along_axis(triangles, order, axis=1)
    # Diagonals climb from colour 0 to 1 to 2 in one layer and fall in the next: no twist.
    pattern = np.array([[0, 1, 2, 5], [0, 1, 4, 5], [0, 3, 4, 5]])
    tets = []
    for k in range(layers):
        bottom, top = (k, k + 1) if k % 2 == 0 else (k + 1, k)
        prism = np.concatenate([low + n * bottom, low + n * top], axis=1)
        tets.append(prism[:, pattern].reshape(-1, 4))
    zeta = np.repeat(np.arange(layers + 1) / layers, n)
    return np.tile(rho, layers + 1), np.tile(theta, layers + 1), zeta, np.concatenate(tets)


def _disc(rings: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A hexagon of the triangular lattice made round: rho, theta, a 3-colouring and triangles."""
    step = np.array([[1, 0], [0, 1], [-1, 1], [-1, 0], [0, -1], [1, -1]])
    rows = [(0, 0, 0.0, 0.0)]
    for k in range(1, rings + 1):
        for s in range(6):
            for m in range(k):
                a, b = k * step[s] + m * step[(s + 2) % 6]
                rows.append((a, b, k / rings, (s + m / k) * np.pi / 3.0))
    index = {(int(a), int(b)): i for i, (a, b, _, _) in enumerate(rows)}
    triangles = []
    for (a, b), i in index.items():
        for corner in (((a + 1, b), (a, b + 1)), ((a - 1, b), (a, b - 1))):
            if all(c in index for c in corner):
                triangles.append((i, index[corner[0]], index[corner[1]]))
    a, b, rho, theta = np.array(rows).T
    return rho, theta, (a - b).astype(int) % 3, np.array(triangles)


def _shell_count(n: int) -> int:
    return 1 + sum(10 * k * k + 2 for k in range(1, n + 1))


def _icosahedral_ball(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Shell k of n carries the icosahedron whose edges are split k times.

    A tet (centre, a, b, c) is refined into small tets and octahedra; these are cut about their
    shortest diagonal, which always runs between two shells: no tet has all corners on the surface.
    """
    golden = 0.5 * (1.0 + 5.0**0.5)
    signs = [(s, t) for s in (1, -1) for t in (golden, -golden)]
    corner = np.array([np.roll([0.0, s, t], k) for k in range(3) for s, t in signs])
    near = np.linalg.norm(corner[:, None] - corner, axis=2) < 2.1  # edges have length 2
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i)
        for k in range(j)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    parts = _refined_tet(n)
    weight = np.zeros((20, *parts.shape[:2], 13), dtype=int)  # of the corners and the centre
    for f, face in enumerate(faces):
        weight[f][..., [12, *face]] = parts
    weights, ids = np.unique(weight.reshape(-1, 13), axis=0, return_inverse=True)
    direction = weights[:, :12] @ corner
    length = np.maximum(np.linalg.norm(direction, axis=1), 1e-9)
    x = direction * ((n - weights[:, 12]) / n / length)[:, None]
    ids = ids.reshape(-1, parts.shape[1])
    return x, _cut(x, ids)


def _refined_tet(n: int) -> np.ndarray:
    """Barycentric corner weights, summing to n, of the small tets and octahedra, shape (m, 6, 4).

    The corners of an octahedron come as three opposite pairs; a small tet repeats its first corner.
    """
    e = np.eye(4, dtype=int)
    kinds = (
        (1, e[[0, 0, 0, 1, 2, 3]]),
        (2, np.stack([e[i] + e[j] for i, j in ((0, 1), (2, 3), (0, 2), (1, 3), (0, 3), (1, 2))])),
        (3, 1 - e[[0, 0, 0, 1, 2, 3]]),
    )
    grid = np.indices((n + 1,) * 4).reshape(4, -1).T
    parts = [grid[grid.sum(axis=1) == n - lift][:, None] + shape for lift, shape in kinds]
    return np.concatenate(parts)


def _cut(x: np.ndarray, ids: np.ndarray) -> np.ndarray:
    """The small tets as they are and each octahedron as four tets about its shortest diagonal."""
    small = ids[:, 0] == ids[:, 1]
    eight = ids[~small].reshape(-1, 3, 2)
    length = np.linalg.norm(x[eight[:, :, 1]] - x[eight[:, :, 0]], axis=2)
    first = np.argmin(np.round(length, 9), axis=1)  # of equal ones always the same
    turned = (first[:, None] + np.arange(3)) % 3
    around = np.take_along_axis(eight, turned[:, :, None], axis=1).reshape(-1, 6)
    pattern = np.array([[0, 1, 2, 4], [0, 1, 4, 3], [0, 1, 3, 5], [0, 1, 5, 2]])
    return np.concatenate([ids[small][:, 2:], around[:, pattern].reshape(-1, 4)])


@cache
def _coarse_ball() -> tuple[np.ndarray, np.ndarray]:
    """37 points of a spiral on the unit sphere about a regular tet, Delaunay."""
    k = np.arange(37) + 0.5
    z = 1.0 - 2.0 * k / 37.0
    across = np.sqrt(1.0 - z * z)
    angle = np.pi * (1.0 + 5.0**0.5) * k
    hull = np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)
    # Size and rotation of the inner tet maximise the quality of the worst tet, 0.53.
    inner = np.array([[17, -23, 7], [17, 23, -7], [-17, 7, 23], [-17, -7, -23]])
    x = np.concatenate([hull, 0.42 / (17.0 * 3.0**0.5) * inner])
    return x, _delaunay(x, n_hull=37)


def _delaunay(x: np.ndarray, n_hull: int) -> np.ndarray:
    """All fours of points, not all on the hull, whose circumsphere is empty; for few points."""
    four = np.array([c for c in combinations(range(len(x)), 4) if c[3] >= n_hull])
    edge = x[four[:, 1:]] - x[four[:, :1]]
    solid = np.abs(np.linalg.det(edge)) > 1e-9
    four, edge = four[solid], edge[solid]
    half = 0.5 * np.einsum("mij,mij->mi", edge, edge)
    to_centre = np.linalg.solve(edge, half[:, :, None])[:, :, 0]
    centre = x[four[:, 0]] + to_centre
    power = np.sum(x * x, axis=1) - 2.0 * centre @ x.T + np.sum(centre**2, axis=1)[:, None]
    return four[(power > np.sum(to_centre**2, axis=1)[:, None] - 1e-9).all(axis=1)]
