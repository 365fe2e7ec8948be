"""A surface of triangles, open or closed: what obstacles and pictures are often given as."""

from functools import cached_property
from pathlib import Path

import numpy as np

from warp_contact import checks
from warp_contact.data.model import Solid
from warp_contact.scene import pieces, surface_files
from warp_contact.scene.materials import Rigid
from warp_contact.scene.topology import HUGE, MOST, MeshError, signed_volumes


class Surface:
    """Triangles that turn counter-clockwise seen from outside.

    Attributes:
        vertices: positions [m], shape (n, 3), float64, read-only
        triangles: vertex ids, shape (f, 3), int32, read-only
        uv: texture coordinates of each corner of each triangle, shape (f, 3, 2), or None
        normals: unit normals of the same, shape (f, 3, 3), or None
        texture: path of a picture that ``uv`` refer to, or None
        colors: linear red, green, blue of all vertices or each, shape (3,) or (n, 3), or None
    """

    def __init__(self, vertices, triangles, uv=None, normals=None, *, texture=None, colors=None):
        """Check; raises MeshError, ValueError for colours that are none, OSError for a texture."""
        x, tris = checks.array_of(vertices), checks.array_of(triangles)
        if x.dtype.kind not in "fiu" or x.ndim != 2 or x.shape[1] != 3 or not 0 < len(x) <= MOST:
            what = f"of shape {x.shape} and type {x.dtype}"
            raise MeshError(f"vertices {what}: give numbers of shape (n, 3), n > 0")
        if tris.dtype.kind not in "iu" or tris.ndim != 2 or tris.shape[1] != 3 or not len(tris):
            what = f"of shape {tris.shape} and type {tris.dtype}"
            raise MeshError(f"triangles {what}: give whole numbers of shape (f, 3), f > 0")
        bad = np.flatnonzero(~(np.abs(x) < HUGE).all(axis=1))
        if len(bad):
            raise MeshError(f"vertex {bad[0]} is not finite or beyond {HUGE:g} m: {x[bad[0]]}")
        bad = np.flatnonzero(((tris < 0) | (tris >= len(x))).any(axis=1))
        if len(bad):
            text = f"triangle {bad[0]} is {tris[bad[0]].tolist()}"
            raise MeshError(f"{text}: index outside 0..{len(x) - 1}")
        bad = np.flatnonzero((tris == np.roll(tris, 1, axis=1)).any(axis=1))
        if len(bad):
            raise MeshError(f"triangle {bad[0]} repeats a vertex: {tris[bad[0]].tolist()}")
        self.vertices, self.triangles = _frozen(x.astype(float)), _frozen(tris.astype(np.int32))
        self.uv = _of_corners(uv, (len(tris), 3, 2), "uv")
        self.normals = _of_corners(normals, (len(tris), 3, 3), "normals", unit=True)
        self.texture = None if texture is None else _picture(texture)
        self.colors = None if colors is None else _frozen(checks.colors(colors, len(x)))

    def __repr__(self) -> str:
        """Counts only."""
        kind = "closed" if self.is_closed else "open"
        return f"<Surface {len(self.vertices)} vertices, {len(self.triangles)} triangles, {kind}>"

    @cached_property
    def areas(self) -> np.ndarray:
        """Area vectors of the triangles [m^2], outward, shape (f, 3)."""
        a, b, c = np.moveaxis(self.vertices[self.triangles], 1, 0)
        return _frozen(0.5 * np.cross(b - a, c - a))

    @property
    def is_closed(self) -> bool:
        """Whether every edge has two triangles, which turn the same way."""
        key, back = self._half_edges
        return len(np.unique(key)) == len(key) and bool(np.isin(key, back).all())

    @property
    def _half_edges(self) -> tuple[np.ndarray, np.ndarray]:
        """One number for each edge p -> q of each triangle, and for q -> p, shape (3 f,)."""
        p = self.triangles.ravel().astype(np.int64)
        q, n = np.roll(self.triangles, -1, axis=1).ravel().astype(np.int64), len(self.vertices)
        return p * n + q, q * n + p

    def check_sheet(self) -> None:
        """Raise MeshError where it is no sheet.

        More than two triangles meet at an edge, two turn opposite ways, or some hang on others by a
        vertex alone.
        """
        key, back = self._half_edges
        order, n = np.argsort(key, kind="stable"), len(self.vertices)
        same = np.flatnonzero(np.diff(key[order]) == 0)
        if len(same):
            one, other = sorted((order[same[0] : same[0] + 2] // 3).tolist())
            p, q = divmod(int(key[order[same[0]]]), n)
            raise MeshError(
                f"triangles {one} and {other} both go along the edge from vertex {p} to {q}: more "
                f"than two meet there, or one is turned round; repair it, as in Blender by "
                f"Recalculate Normals"
            )
        # Corner k of triangle t is number 3 t + k, where its half-edge to the next corner begins.
        twin = order[np.minimum(np.searchsorted(key[order], back), len(key) - 1)]
        here = np.flatnonzero(key[twin] == back)
        ahead = twin[here] // 3 * 3 + (twin[here] + 1) % 3
        fan = pieces.components(np.stack([here, ahead], axis=1), len(key))
        fans = np.unique(np.stack([self.triangles.ravel(), fan], axis=1), axis=0)[:, 0]
        bad = fans[:-1][np.diff(fans) == 0]
        if len(bad):
            text = "its triangles form several fans that only hang together there"
            raise MeshError(f"vertex {bad[0]}: {text}; part them")

    @property
    def volume(self) -> float:
        """Volume that it encloses [m^3]; raises MeshError for one that is open or inside out."""
        return self._moments(1.0)[0]

    def rigid(self, density: float) -> Rigid:
        """A rigid material of the mass, centre and inertia of the solid that it encloses.

        By the divergence theorem: sums over the tets from one point to each triangle are exact.

        Args:
            density: [kg/m^3]

        Raises:
            ValueError: a density that is none; MeshError: it is open or inside out
        """
        density = checks.positive(density, "density")
        mass, centre, inertia = self._moments(density)
        return Rigid(mass=mass, centre=tuple(centre.tolist()), inertia=inertia)

    def _moments(self, density: float) -> tuple[float, np.ndarray, np.ndarray]:
        """Mass [kg], centre [m] and inertia about it [kg m^2] of what it encloses."""
        if not self.is_closed:
            raise MeshError("a surface that is not closed encloses nothing: close it first")
        x = np.concatenate([self.vertices, self.vertices.mean(axis=0, keepdims=True)])
        apex = np.full((len(self.triangles), 1), len(self.vertices))
        tets = np.concatenate([self.triangles, apex], axis=1)[:, [0, 2, 1, 3]]
        if signed_volumes(x, tets).sum() <= 0.0:
            raise MeshError("the surface is flat, or inside out: then turn its triangles round")
        solid: Solid = Rigid(density).solid(x, tets)
        return float(solid.mass), solid.centre, solid.inertia

    def transformed(self, matrix, translation=(0.0, 0.0, 0.0)) -> "Surface":
        """Map each vertex x to matrix x + translation [m]; a mirroring one turns triangles."""
        matrix = checks.numbers(matrix, (3, 3), "matrix")
        move = checks.numbers(translation, (3,), "translation", most=HUGE)
        if abs(np.linalg.det(matrix)) < checks.SMALLEST:
            raise checks.refuse("matrix", matrix.tolist(), "one that flattens nothing")
        turn = [0, 1, 2] if np.linalg.det(matrix) > 0.0 else [0, 2, 1]
        normals = self.normals
        if normals is not None:
            normals = (normals @ np.linalg.inv(matrix))[:, turn]
        uv = None if self.uv is None else self.uv[:, turn]
        x, looks = self.vertices @ matrix.T + move, {"texture": self.texture, "colors": self.colors}
        return Surface(x, self.triangles[:, turn], uv, normals, **looks)

    def moved(self, vertices) -> "Surface":
        """The same triangles at other positions [m], shape (n, 3), without normals."""
        x = checks.numbers(vertices, self.vertices.shape, "vertices", HUGE)
        return Surface(x, self.triangles, self.uv, texture=self.texture, colors=self.colors)

    def welded(self, tolerance: float) -> "Surface":
        """The same with one vertex for all that are nearer than a tolerance [m].

        It closes the cracks of files whose numbers are rounded. Triangles that become flat go.

        Raises:
            ValueError: a tolerance that is none; MeshError: no triangle is left
        """
        pairs = pieces.coincident(self.vertices, checks.positive(tolerance, "tolerance"))
        tris = pieces.components(pairs, len(self.vertices))[self.triangles]
        whole = (tris != np.roll(tris, 1, axis=1)).all(axis=1)
        if not whole.any():
            raise MeshError(f"no triangle is larger than {tolerance:g} m: give a smaller tolerance")
        kept, tris = np.unique(tris[whole], return_inverse=True)
        uv, normals = (None if of is None else of[whole] for of in (self.uv, self.normals))
        each = self.colors is not None and self.colors.ndim == 2
        looks = {"texture": self.texture, "colors": self.colors[kept] if each else self.colors}
        return Surface(self.vertices[kept], tris.reshape(-1, 3), uv, normals, **looks)

    @staticmethod
    def load(path, prim: str | None = None, unit: float | None = None) -> "Surface":
        """Read STL, OBJ, PLY or another format of meshio, or a Mesh of USD.

        From USD comes the first Mesh or the one at the path ``prim``, as placed in the stage at its
        earliest time, in metres and with z up where the stage says what it has, and unsubdivided.
        Polygons are cut into triangles, vertices in exactly the same place are joined.

        Args:
            path: the file
            prim: path of a Mesh in a USD file
            unit: metres per unit of the file, such as 1e-3; for files that do not say it

        Raises:
            OSError: there is no such file, or it is none
            ValueError: it is damaged, holds no surface or says its unit itself; MeshError for most
        """
        found = surface_files.load(path, prim, unit)
        try:
            return Surface(**found)
        except MeshError as error:
            raise MeshError(f"{path}: {error}") from None

    @staticmethod
    def load_frames(
        path, prim: str | None = None, unit: float | None = None, *, fps: float = 60.0
    ) -> np.ndarray:
        """Positions [m] of the vertices that ``load`` gives, at each frame, shape (k, n, 3).

        Frame 0 is the first sample of the points, or of what moves the prim. Between samples they
        go straight. The faces of the Mesh stay the same.

        Args:
            path: a USD file
            prim: path of a Mesh in it
            unit: as in ``load``
            fps: frames a second

        Raises:
            OSError: as ``load``
            ValueError: as ``load``; faces or the number of points change
        """
        return surface_files.load_frames(path, prim, unit, checks.positive(fps, "fps"))


def _picture(path) -> Path:
    path, known = checks.path(path, "texture"), surface_files.PICTURES
    if path.suffix.lower() not in known:
        raise checks.refuse("texture", path.name, f"a picture, one of {' '.join(known)}")
    if not path.is_file():
        raise FileNotFoundError(f"no such texture: {path}")
    return path


def _of_corners(values, shape: tuple, name: str, unit: bool = False) -> np.ndarray | None:
    """Values of corners of triangles, scaled to a length of 1 where that is their ``unit``."""
    if values is None:
        return None
    values = checks.numbers(values, shape, name)
    if unit:
        length = np.linalg.norm(values, axis=2, keepdims=True)
        if length.min() < checks.SMALLEST:
            raise MeshError(f"{name} of triangle {length.min(axis=(1, 2)).argmin()} are zero")
        values /= length
    return _frozen(values)


def _frozen(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array
