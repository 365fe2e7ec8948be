"""A tetrahedral mesh: arrays in, checked and oriented; surface, edges, files out."""

from functools import cached_property

import numpy as np

from warp_contact import checks
from warp_contact.scene import files, pieces, topology
from warp_contact.scene.topology import EDGES, MeshError

__all__ = ["MeshError", "TetMesh"]


class TetMesh:
    """A body's rest shape.

    Attributes:
        vertices: positions [m], shape (n, 3), float64, read-only
        tets: positively oriented vertex ids, shape (m, 4), int32, read-only
        surface: outward triangles in the order of their tets, shape (f, 3), int32
        surface_edges: p < q and their triangles t1 (has p -> q) and t2 (has q -> p), shape (k, 4)
    """

    def __init__(self, vertices, tets):
        """Check and orient; raises MeshError."""
        x, tets = topology.as_arrays(vertices, tets)
        topology.check_elements(x, tets)
        flip = topology.signed_volumes(x, tets) < 0.0
        tets[flip] = tets[flip][:, [0, 1, 3, 2]]
        self.vertices = _frozen(x)
        self.tets = _frozen(tets)
        self.surface = _frozen(topology.boundary(tets, len(x)))
        self.surface_edges = _frozen(topology.pair_edges(self.surface, len(x)))
        topology.check_fans(self.surface, self.surface_edges)

    def __repr__(self) -> str:
        """Counts only."""
        counts = f"{len(self.vertices)} vertices, {len(self.tets)} tets"
        apart = f" in {self.n_pieces} pieces" if self.n_pieces > 1 else ""
        return f"<TetMesh {counts}{apart}, {len(self.surface)} surface triangles>"

    @cached_property
    def volumes(self) -> np.ndarray:
        """Volume of each tet [m^3], shape (m,)."""
        return _frozen(topology.signed_volumes(self.vertices, self.tets))

    @property
    def volume(self) -> float:
        """Volume of the body [m^3]."""
        return float(self.volumes.sum())

    @cached_property
    def edges(self) -> np.ndarray:
        """Edges of the tets, each once with p < q, in ascending order, shape (e, 2), int32."""
        n = len(self.vertices)
        pair = np.sort(self.tets[:, EDGES].reshape(-1, 2).astype(np.int64), axis=1)
        key = topology.unique(pair[:, 0] * n + pair[:, 1])
        return _frozen(np.stack([key // n, key % n], axis=1).astype(np.int32))

    @cached_property
    def quality(self) -> np.ndarray:
        """6 sqrt(2) V / l_rms^3 of each tet: 1 for a regular one, 0 for a flat one, shape (m,)."""
        corner = self.vertices[self.tets]
        edge = corner[:, EDGES[:, 1]] - corner[:, EDGES[:, 0]]
        l2 = np.einsum("mek,mek->m", edge, edge) / 6.0
        return _frozen(6.0 * np.sqrt(2.0) * self.volumes / l2**1.5)

    @cached_property
    def n_pieces(self) -> int:
        """Number of pieces: parts that share no vertex."""
        label = pieces.components(self.edges, len(self.vertices))
        return int((label == np.arange(len(label))).sum())

    @cached_property
    def seams(self) -> np.ndarray:
        """Pairs of surface vertices in the same place, which nothing joins, shape (k, 2), int64.

        ``welded`` makes one of each.
        """
        ids = np.unique(self.surface)
        return _frozen(ids[pieces.coincident(self.vertices[ids], self._seam)])

    @property
    def _seam(self) -> float:
        """Distance [m] below which two vertices are in the same place."""
        p, q = self.vertices[self.edges.T]
        return pieces.SEAM * float(np.linalg.norm(p - q, axis=1).mean())

    def welded(self, tolerance: float | None = None) -> "TetMesh":
        """The same mesh with one vertex for all that are in the same place.

        Args:
            tolerance: distance [m] up to which they are; a millionth of the mean edge if None

        Raises:
            MeshError: a tet would lose its volume, or the result is no mesh
        """
        near = self._seam if tolerance is None else checks.positive(tolerance, "tolerance")
        pairs = pieces.coincident(self.vertices, near)
        return TetMesh(*pieces.welded(self.vertices, self.tets, pairs))

    def transformed(self, matrix, translation=(0.0, 0.0, 0.0)) -> "TetMesh":
        """Map each vertex x to matrix x + translation [m]; a mirroring matrix is allowed."""
        matrix = checks.numbers(matrix, (3, 3), "matrix")
        move = checks.numbers(translation, (3,), "translation", most=topology.HUGE)
        return TetMesh(self.vertices @ matrix.T + move, self.tets)

    def scaled(self, sx: float, sy: float, sz: float) -> "TetMesh":
        """Stretch about the origin; turns a sphere into an ellipsoid."""
        for name, factor in zip(("sx", "sy", "sz"), (sx, sy, sz), strict=True):
            if checks.number(factor, name) == 0.0:
                raise checks.refuse(name, factor, "another number than zero")
        return self.transformed(np.diag([sx, sy, sz]))

    def reordered(self) -> tuple["TetMesh", np.ndarray]:
        """The same shape with neighbours close in memory, for meshes whose numbering jumps about.

        Vertices follow a Z-order curve (Morton 1966), tets their first vertex along it.

        Returns:
            The mesh, and which vertex of this one each of its vertices is, shape (n,).
        """
        order = np.argsort(topology.morton_codes(self.vertices), kind="stable")
        place = np.empty(len(order), dtype=self.tets.dtype)
        place[order] = np.arange(len(order))
        tets = place[self.tets]
        first = np.argsort(tets.min(axis=1), kind="stable")
        return TetMesh(self.vertices[order], tets[first]), order

    def save(self, path) -> None:
        """Write ``.npz``, USD (``.usd``, ``.usda``, ``.usdc``) or, by suffix, what meshio knows."""
        files.save(path, self.vertices, self.tets, self.surface)

    @staticmethod
    def load(path, prim: str | None = None, unit: float | None = None) -> "TetMesh":
        """Read what ``save`` writes, and with meshio many other formats.

        From USD comes the first TetMesh or the one at the path ``prim``, as placed in the stage at
        its earliest time, in metres where the stage says what its unit is, and with z up where it
        says that y is. Other formats often list auxiliary vertices: those that no tet uses are
        dropped. Hexes, prisms and pyramids are cut into tets; of cells of higher order the corners
        are taken. A file that holds only a surface is refused: it has to be filled before.

        Args:
            path: the file
            prim: path of a TetMesh in a USD file
            unit: metres per unit of the file, such as 1e-3; for files that do not say it

        Raises:
            OSError: there is no such file, or it is none
            ValueError: it is damaged, holds no mesh or says its unit itself; MeshError for most
        """
        vertices, tets = files.load(path, prim, unit)
        try:
            return TetMesh(vertices, tets)
        except MeshError as error:
            raise MeshError(f"{path}: {error}") from None


def _frozen(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array
