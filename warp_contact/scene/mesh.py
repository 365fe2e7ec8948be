"""A tetrahedral mesh: arrays in, checked and oriented; surface, edges, files out."""

from contextlib import redirect_stderr, redirect_stdout
from functools import cached_property
from io import StringIO
from pathlib import Path

import numpy as np

from warp_contact.scene import topology
from warp_contact.scene.topology import EDGES, MeshError

__all__ = ["MeshError", "TetMesh"]

USD = (".usd", ".usda", ".usdc")


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
        return f"<TetMesh {counts}, {len(self.surface)} surface triangles>"

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

    def transformed(self, matrix, translation=(0.0, 0.0, 0.0)) -> "TetMesh":
        """Map each vertex x to matrix x + translation [m]; a mirroring matrix is allowed."""
        x = self.vertices @ np.asarray(matrix, dtype=float).T + np.asarray(translation, dtype=float)
        return TetMesh(x, self.tets)

    def scaled(self, sx: float, sy: float, sz: float) -> "TetMesh":
        """Stretch about the origin; turns a sphere into an ellipsoid."""
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
        path = Path(path)
        if not path.parent.is_dir():
            raise FileNotFoundError(f"no such folder: {path.parent}")
        if path.suffix == ".npz":
            np.savez_compressed(path, vertices=self.vertices, tets=self.tets)
        elif path.suffix in USD:
            _save_usd(path, self)
        else:
            meshio = _meshio(path)
            mesh = meshio.Mesh(self.vertices, [("tetra", self.tets)])
            _or_mesh_error(path, "written", lambda: meshio.write(path, mesh))

    @staticmethod
    def load(path, prim: str | None = None) -> "TetMesh":
        """Read what ``save`` writes; the unit is the metre.

        From USD comes the first TetMesh or the one at the path ``prim``, as placed in the stage at
        its earliest time, in metres where the stage says what its unit is, and with z up where it
        says that y is. Other formats often list auxiliary vertices: those that no tet uses are
        dropped.
        """
        path = Path(path)
        if not path.exists():
            raise FileNotFoundError(f"no such mesh file: {path}")
        if path.suffix == ".npz":
            vertices, tets = _or_mesh_error(path, "read", lambda: _load_npz(path))
        elif path.suffix in USD:
            vertices, tets = _load_usd(path, prim)
        else:
            vertices, tets = _load_meshio(path)
        return TetMesh(vertices, tets)


def _frozen(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array


def _load_npz(path: Path) -> tuple[np.ndarray, np.ndarray]:
    with np.load(path, allow_pickle=False) as data:
        return data["vertices"], data["tets"]


def _or_mesh_error(path: Path, verb: str, action):
    """Run a reader or writer without output; its errors become one MeshError."""
    try:
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            return action()
    except OSError:
        raise
    except (Exception, SystemExit) as error:  # meshio leaves by sys.exit
        raise MeshError(f"{path}: cannot be {verb} as a '{path.suffix}' mesh") from error


def _meshio(path: Path):
    try:
        import meshio
    except ImportError as error:
        hint = "needs meshio: pip install 'warp_contact[mesh]'"
        raise MeshError(f"{path}: the format '{path.suffix}' {hint}") from error
    return meshio


def _load_meshio(path: Path) -> tuple[np.ndarray, np.ndarray]:
    meshio = _meshio(path)
    mesh = _or_mesh_error(path, "read", lambda: meshio.read(path))
    tets = [block.data for block in mesh.cells if block.type == "tetra"]
    if not tets:
        raise MeshError(f"{path}: holds no tets")
    used, tets = np.unique(np.concatenate(tets), return_inverse=True)
    return mesh.points[used], tets.reshape(-1, 4)


def _save_usd(path: Path, mesh: TetMesh) -> None:
    from pxr import Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    prim = UsdGeom.TetMesh.Define(stage, "/mesh")
    stage.SetDefaultPrim(prim.GetPrim())
    points = mesh.vertices.astype(np.float32)
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    prim.CreateTetVertexIndicesAttr(Vt.Vec4iArray.FromNumpy(mesh.tets))
    prim.CreateSurfaceFaceVertexIndicesAttr(Vt.Vec3iArray.FromNumpy(mesh.surface))
    prim.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([points.min(0), points.max(0)])))
    stage.Export(str(path))


def _load_usd(path: Path, name: str | None) -> tuple[np.ndarray, np.ndarray]:
    from pxr import Usd, UsdGeom

    stage = _or_mesh_error(path, "read", lambda: Usd.Stage.Open(str(path)))
    found = [p for p in stage.Traverse() if p.IsA(UsdGeom.TetMesh)]
    if name is not None:
        found = [p for p in found if str(p.GetPath()) == name]
    if not found:
        raise MeshError(f"{path}: holds no TetMesh" + (f" at {name}" if name else ""))
    time = Usd.TimeCode.EarliestTime()
    tetmesh = UsdGeom.TetMesh(found[0])
    points = np.array(tetmesh.GetPointsAttr().Get(time), dtype=float)
    tets = np.array(tetmesh.GetTetVertexIndicesAttr().Get(time))
    if points.ndim != 2 or tets.ndim != 2:
        raise MeshError(f"{path}: the TetMesh {found[0].GetPath()} has no points or no tets")
    place = np.array(tetmesh.ComputeLocalToWorldTransform(time))  # acts on row vectors
    stated = stage.HasAuthoredMetadata("metersPerUnit")
    unit = UsdGeom.GetStageMetersPerUnit(stage) if stated else 1.0
    x = unit * (points @ place[:3, :3] + place[3, :3])
    y_up = stage.HasAuthoredMetadata("upAxis") and UsdGeom.GetStageUpAxis(stage) == "Y"
    return x[:, [0, 2, 1]] * (1.0, -1.0, 1.0) if y_up else x, tets
