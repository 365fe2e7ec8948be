"""Thin shells of tets on surfaces and height fields: obstacles from what is no solid.

Each triangle becomes a prism between the surface and a copy of it, and each prism three tets. A
side over the edge p < q is cut from p below to q above, so that neighbours agree. The copy lies at
x + t d, where d solves

    n . d = 1   for all planes of normal n at a vertex, in the least squares of their angles there

so that also about edges and corners its faces are t away. Shallow creases count as flat, and d is
no longer than ``LONGEST``.
"""

import numpy as np

from warp_contact import checks
from warp_contact.scene.mesh import TetMesh
from warp_contact.scene.surface import Surface
from warp_contact.scene.topology import HUGE, MeshError, signed_volumes

# Of the corners of a prism, 0 to 2 below and 3 to 5 above, in the order of their numbers.
TETS = np.array([[0, 1, 2, 5], [0, 4, 1, 5], [0, 3, 4, 5]])
SIDES = {"outside": (0.0, 1.0), "inside": (1.0, 0.0), "both": (0.5, 0.5)}  # below, above
SHALLOW = 1e-2  # of the squares of normals: what is across them is rounding, or a smooth bend
LONGEST = 2.0  # at most, of d: an edge of 60 degrees
LEAST = 0.1  # of its volume on a flat surface that a tet must keep
BISECTIONS = 40


def shell(surface: Surface, thickness: float, side: str = "outside") -> TetMesh:
    """A shell of tets on a surface, open or closed.

    Its vertices are those of the surface twice: first the side below, then the one above, seen
    from where triangles turn counter-clockwise. An obstacle is held by ``fixed=True``. Bodies pass
    through a shell that is thin against what they move in a step; so a thin one asks for more steps
    where something is fast.

    Args:
        surface: an open one, or a closed one that stays hollow
        thickness: [m]
        side: on which side of the surface the material is, ``outside``, ``inside`` or ``both``;
            the outside of a closed one is that which it does not enclose, however triangles turn

    Raises:
        ValueError: a thickness or side that is none; MeshError: a triangle whose prism would turn
            inside out, with the largest thickness that works; edges where more than two meet
    """
    checks.instance(surface, Surface, "surface", "a wc.Surface, such as wc.Surface.load(path)")
    thickness = checks.positive(thickness, "thickness")
    checks.one_of(side, tuple(SIDES), "side")
    surface.check_sheet()
    used, tris = np.unique(surface.triangles, return_inverse=True)
    tris, x = tris.reshape(-1, 3), surface.vertices[used]
    areas = surface.areas
    if surface.is_closed and np.sum(x[tris].mean(axis=1) * areas) < 0.0:  # inside out
        tris, areas = tris[:, ::-1], -areas
    d = _directions(x, tris, areas)
    below, above = SIDES[side]

    def layers(t: float) -> np.ndarray:
        return np.concatenate([x - below * t * d, x + above * t * d])

    tets = _tets(tris, len(x))
    _check(layers, tets, thickness, np.linalg.norm(surface.areas, axis=1))
    return TetMesh(layers(thickness), tets)


def heightfield(heights, size, thickness: float) -> TetMesh:
    """A shell of tets below a grid of heights, about the origin in x and y.

    Vertices are those of the lower side, then of the upper one, with y running fastest.

    Args:
        heights: z of the upper side [m], shape (n, m): n along x, m along y
        size: along x and y [m], or one number for both
        thickness: along z [m]

    Raises:
        ValueError: they are none, or fewer than two along x or y
    """
    z = checks.array_of(heights)
    if z.ndim != 2 or min(z.shape) < 2:
        raise checks.refuse("heights", heights, "numbers of shape (n, m), of two or more each")
    z = checks.numbers(z, z.shape, "heights", HUGE)
    if checks.array_of(size).ndim:
        size = [checks.positive(s, "size") for s in checks.numbers(size, (2,), "size")]
    else:
        size = [checks.positive(size, "size")] * 2
    thickness = checks.positive(thickness, "thickness")
    along = (np.linspace(-0.5 * s, 0.5 * s, n) for s, n in zip(size, z.shape, strict=True))
    x, y = np.meshgrid(*along, indexing="ij")
    top = np.stack([x, y, z], axis=2).reshape(-1, 3)
    ids = np.arange(len(top)).reshape(z.shape)
    a, b, c, d = (part.ravel() for part in (ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]))
    tris = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return TetMesh(np.concatenate([top - (0.0, 0.0, thickness), top]), _tets(tris, len(top)))


def _tets(tris: np.ndarray, n: int) -> np.ndarray:
    """Tets between triangles over ``n`` vertices below and ``n`` above, positive, (3 f, 4)."""
    order = np.argsort(tris, axis=1)
    low = np.take_along_axis(tris, order, axis=1)
    tets = np.concatenate([low, low + n], axis=1)[:, TETS]
    odd = np.linalg.det(np.eye(3)[order]) < 0.0
    tets[odd] = tets[odd][:, :, [0, 2, 1, 3]]
    return tets.reshape(-1, 4)


def _directions(x: np.ndarray, tris: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """The direction d of each vertex [-], shape (n, 3)."""
    size = np.linalg.norm(areas, axis=1)
    flat = np.flatnonzero(~(size > checks.SMALLEST))
    if len(flat):
        raise MeshError(f"triangle {flat[0]} has no area: {tris[flat[0]].tolist()}; repair it")
    normal = areas / size[:, None]
    corner = x[tris]
    one, other = np.roll(corner, -1, axis=1) - corner, np.roll(corner, 1, axis=1) - corner
    cosine = np.einsum("fki,fki->fk", one, other)
    weight = np.arctan2(2.0 * size[:, None], cosine)  # angles [rad]
    right, square = np.zeros((len(x), 3)), np.zeros((len(x), 3, 3))
    for k in range(3):
        w = weight[:, k, None]
        np.add.at(right, tris[:, k], w * normal)
        np.add.at(square, tris[:, k], (w * normal)[:, :, None] * normal[:, None])
    value, axis = np.linalg.eigh(square)
    counts = value > SHALLOW * value[:, -1:]
    part = np.einsum("nij,ni->nj", axis, right)
    part = np.divide(part, value, out=np.zeros_like(part), where=counts)
    d = np.einsum("nij,nj->ni", axis, part)
    length = np.linalg.norm(d, axis=1, keepdims=True)
    return d * np.minimum(1.0, LONGEST / np.maximum(length, checks.SMALLEST))


def _check(layers, tets: np.ndarray, thickness: float, area: np.ndarray) -> None:
    """Raise MeshError where a tet between ``layers(thickness)`` loses its volume."""
    area = np.repeat(area, len(TETS))

    def lost(t: float) -> np.ndarray:
        return signed_volumes(layers(t), tets) < LEAST * area * t / 3.0

    bad = np.flatnonzero(lost(thickness))
    if not len(bad):
        return
    works, fails = 0.0, thickness
    for _ in range(BISECTIONS):
        middle = 0.5 * (works + fails)
        works, fails = (works, middle) if lost(middle).any() else (middle, fails)
    most = f"{works:.3g} m is the largest thickness that works"
    if works < 1e-9 * thickness:
        most = "no thickness works: the surface folds back onto itself there"
    raise MeshError(
        f"triangle {bad[0] // len(TETS)} would turn inside out: the surface bends more sharply "
        f"there than a shell {thickness:g} m thick can follow; {most}; take the other side, or "
        f"smooth it"
    )
