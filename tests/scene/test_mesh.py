"""mesh.py and topology.py: orientation, surface, edges, refusals, files."""

import sys

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from warp_contact.scene import topology
from warp_contact.scene.mesh import MeshError, TetMesh
from warp_contact.scene.shapes import box, sphere

SEED = 11
CORNER = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
ONE = [[0, 1, 2, 3]]


@pytest.fixture
def rng() -> np.random.Generator:
    print(f"seed {SEED}")
    return np.random.default_rng(SEED)


@pytest.fixture
def mesh() -> TetMesh:
    return box((1.0, 0.7, 1.3), (3, 2, 4))


def enclosed(x: np.ndarray, surface: np.ndarray) -> float:
    """Volume from the divergence theorem."""
    a, b, c = (x[surface[:, k]] for k in range(3))
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0)


def rotated_to_smallest(triangles: np.ndarray) -> set:
    """Triangles as a set that keeps their orientation."""
    return {tuple(np.roll(t, -int(np.argmin(t))).tolist()) for t in triangles}


def test_tets_of_either_orientation_become_positive(mesh, rng):
    tets = mesh.tets.copy()
    flip = rng.random(len(tets)) < 0.5
    tets[flip] = tets[flip][:, [1, 0, 2, 3]]
    again = TetMesh(mesh.vertices, tets)
    assert (again.volumes > 0.0).all()
    # Sum of 120 products of order 1e-2, in float64.
    assert again.volume == pytest.approx(0.91, rel=1e-13)
    assert rotated_to_smallest(again.surface) == rotated_to_smallest(mesh.surface)


def test_the_surface_encloses_the_volume_of_the_tets(rng):
    for mesh in (box(1.0, 3), sphere(1.0, 41), sphere(1.0, 309)):
        moved = mesh.transformed(rng.normal(size=(3, 3)), rng.normal(size=3))
        # Rounding of some hundred terms of the same size as the sum.
        assert enclosed(moved.vertices, moved.surface) == pytest.approx(moved.volume, rel=1e-11)
        assert moved.volume > 0.0


def test_the_surface_of_a_box_faces_outwards(mesh):
    corner = mesh.vertices[mesh.surface]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert (np.einsum("fi,fi->f", normal, corner.mean(axis=1)) > 0.0).all()
    # 2 triangles on each cell face.
    assert len(mesh.surface) == 2 * 2 * (3 * 2 + 2 * 4 + 3 * 4)


def test_surface_edges_join_two_triangles_of_opposite_direction(mesh):
    assert 2 * len(mesh.surface_edges) == 3 * len(mesh.surface)
    for p, q, t1, t2 in mesh.surface_edges:
        one, two = mesh.surface[t1].tolist(), mesh.surface[t2].tolist()
        assert p < q
        assert one[(one.index(p) + 1) % 3] == q
        assert two[(two.index(q) + 1) % 3] == p


def test_edges_are_those_of_the_tets_each_once(mesh):
    expected = {
        tuple(sorted((int(t[i]), int(t[j])))) for t in mesh.tets for i in range(4) for j in range(i)
    }
    assert list(map(tuple, mesh.edges.tolist())) == sorted(expected)


def test_the_surface_does_not_depend_on_how_large_vertex_ids_may_be(mesh):
    few = topology.boundary(mesh.tets, len(mesh.vertices))
    np.testing.assert_array_equal(topology.boundary(mesh.tets, 2**30), few)


def test_quality_is_one_for_a_regular_tet():
    regular = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
    # A handful of roundings.
    assert TetMesh(regular, ONE).quality[0] == pytest.approx(1.0, abs=1e-14)


def test_arrays_are_copies_and_cannot_be_written(mesh):
    x = CORNER.copy()
    own = TetMesh(x, ONE)
    x[0] = 7.0
    assert own.vertices[0, 0] == 0.0
    for array in (own.vertices, own.tets, own.surface, own.surface_edges, own.edges, own.quality):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_transformed_maps_vertices_and_accepts_a_mirror(mesh):
    mirror = mesh.transformed(np.diag([-1.0, 1.0, 1.0]), (1.0, 2.0, 3.0))
    np.testing.assert_array_equal(mirror.vertices, mesh.vertices * [-1, 1, 1] + [1, 2, 3])
    assert mirror.volume == pytest.approx(mesh.volume, rel=1e-13)  # float64 rounding
    assert mesh.scaled(1.0, 2.0, 3.0).volume == pytest.approx(6.0 * mesh.volume, rel=1e-13)


REFUSED = {
    "flat vertices": ([[0, 0], [1, 0]], ONE, r"vertices have shape \(2, 2\)"),
    "triangles": (CORNER, [[0, 1, 2]], r"tets have shape \(1, 3\)"),
    "no tets": (CORNER, np.zeros((0, 4), int), r"tets have shape \(0, 4\)"),
    "ragged": ([[0, 0, 0], [1, 0]], ONE, "not arrays of numbers"),
    "real ids": (CORNER, [[0.0, 1.0, 2.0, 3.0]], "tets have type float64"),
    "nan": (CORNER * [[1], [1], [np.nan], [1]], ONE, "vertex 2 is not finite"),
    "infinite": ([*CORNER[:3], [0, 0, np.inf]], ONE, "vertex 3 is not finite"),
    "too high id": (CORNER, [[0, 1, 2, 3], [0, 1, 2, 4]], "tet 1 .*index outside 0..3"),
    "negative id": (CORNER, [[0, 1, 2, -1]], "tet 0 .*index outside 0..3"),
    "repeated vertex": (CORNER, [[0, 1, 2, 3], [0, 1, 3, 1]], "tet 1 repeats a vertex"),
    "duplicate": (
        [*CORNER, [1, 1, 1]],
        [*ONE, [1, 2, 3, 4], [3, 0, 1, 2]],
        "tets 0 and 2 are the same",
    ),
    "flat tet": ([*CORNER, [0.3, 0.3, 0]], [*ONE, [0, 1, 2, 4]], "tet 1 has no volume"),
    "almost flat": ([*CORNER[:3], [0.3, 0.3, 1e-8]], ONE, "tet 0 has no volume"),
    "loose vertex": ([*CORNER, [5, 5, 5]], ONE, "vertex 4 belongs to no tet"),
    "shared thrice": (
        [*CORNER, [0, 0, -1], [0, 0, 2]],
        [*ONE, [0, 2, 1, 4], [0, 1, 2, 5]],
        r"face \[0, 1, 2\] is shared by more than two tets: \[0, 1, 2\]",
    ),
    "overlap": ([*CORNER, [0, 0, 2]], [*ONE, [0, 1, 2, 4]], r"tets 0 and 1 overlap.*\[0, 1, 2\]"),
    "hinge": (
        [*CORNER, [0, -1, 0], [0, 0, -1]],
        [*ONE, [0, 1, 4, 5]],
        r"surface edge \[0, 1\] is not manifold: 4 triangles",
    ),
    "joint": (
        [*CORNER, [-1, 0, 0], [0, -1, 0], [0, 0, -1]],
        [*ONE, [0, 4, 5, 6]],
        "surface vertex 0 is not manifold",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_bad_mesh_is_refused_by_naming_the_element(name):
    vertices, tets, message = REFUSED[name]
    with pytest.raises(MeshError, match=message):
        TetMesh(vertices, tets)


def test_a_tiny_mesh_is_not_called_flat():
    assert TetMesh(1e-6 * CORNER, ONE).volume == pytest.approx(1e-18 / 6.0, rel=1e-12)


def test_npz_keeps_every_bit(mesh, tmp_path):
    mesh.save(tmp_path / "a.npz")
    again = TetMesh.load(tmp_path / "a.npz")
    np.testing.assert_array_equal(again.vertices, mesh.vertices)
    np.testing.assert_array_equal(again.tets, mesh.tets)


@pytest.mark.parametrize("suffix", ["usda", "usdc", "usd"])
def test_usd_keeps_the_mesh_in_single_precision(mesh, tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    mesh.save(path)
    again = TetMesh.load(path)
    np.testing.assert_array_equal(again.vertices, mesh.vertices.astype(np.float32))
    np.testing.assert_array_equal(again.tets, mesh.tets)
    stage = Usd.Stage.Open(str(path))
    prim = UsdGeom.TetMesh(stage.GetDefaultPrim())
    assert len(UsdGeom.TetMesh.FindInvertedElements(prim)) == 0
    computed = np.array(UsdGeom.TetMesh.ComputeSurfaceFaces(prim))
    assert rotated_to_smallest(computed) == rotated_to_smallest(mesh.surface)


def test_usd_is_read_as_placed_and_in_metres(mesh, tmp_path):
    path = str(tmp_path / "two.usda")
    mesh.save(path)
    stage = Usd.Stage.Open(path)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    group = UsdGeom.Xform.Define(stage, "/group")
    group.AddTranslateOp().Set((100.0, 0.0, 0.0))
    second = UsdGeom.TetMesh.Define(stage, "/group/second")
    first = UsdGeom.TetMesh(stage.GetDefaultPrim())
    second.CreatePointsAttr(first.GetPointsAttr().Get())
    second.CreateTetVertexIndicesAttr(first.GetTetVertexIndicesAttr().Get())
    stage.Save()
    placed = TetMesh.load(path, prim="/group/second")
    # Points pass through float32.
    np.testing.assert_allclose(placed.vertices, 0.01 * mesh.vertices + [1, 0, 0], atol=1e-7)
    with pytest.raises(MeshError, match="no TetMesh at /nothing"):
        TetMesh.load(path, prim="/nothing")


@pytest.mark.parametrize("suffix", ["msh", "vtk", "vtu"])
def test_meshio_formats_make_the_round_trip(mesh, tmp_path, suffix):
    pytest.importorskip("meshio")
    mesh.save(tmp_path / f"a.{suffix}")
    again = TetMesh.load(tmp_path / f"a.{suffix}")
    # Some formats are text, with 16 digits.
    np.testing.assert_allclose(again.vertices, mesh.vertices, rtol=1e-14, atol=1e-15)
    np.testing.assert_array_equal(again.tets, mesh.tets)


def test_meshio_vertices_that_no_tet_uses_are_dropped(tmp_path):
    meshio = pytest.importorskip("meshio")
    points = np.concatenate([[[9.0, 9.0, 9.0]], CORNER])
    cells = [("triangle", np.array([[1, 2, 3]])), ("tetra", np.array([[1, 2, 3, 4]]))]
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(points, cells))
    np.testing.assert_array_equal(TetMesh.load(tmp_path / "a.vtu").vertices, CORNER)


def test_a_missing_meshio_is_reported_with_the_extra_to_install(mesh, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "meshio", None)
    with pytest.raises(MeshError, match=r"pip install 'warp_contact\[mesh\]'"):
        mesh.save(tmp_path / "a.vtk")


@pytest.mark.parametrize("name", ["a.npz", "a.usda", "a.vtu", "a.msh", "a.nonsense"])
def test_a_broken_file_is_refused_by_its_name_in_one_line(mesh, tmp_path, name, capfd):
    if name in ("a.vtu", "a.msh", "a.nonsense"):
        pytest.importorskip("meshio")
    (tmp_path / name).write_text("this is no mesh")
    with pytest.raises(MeshError, match=name) as caught:
        TetMesh.load(tmp_path / name)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")
    with pytest.raises(FileNotFoundError, match="missing"):
        TetMesh.load(tmp_path / f"missing{name}")
    with pytest.raises(FileNotFoundError, match="no such folder"):
        mesh.save(tmp_path / "missing" / name)


def test_a_file_without_tets_is_refused(tmp_path):
    meshio = pytest.importorskip("meshio")
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(CORNER, [("triangle", np.array([[0, 1, 2]]))]))
    UsdGeom.Mesh.Define(Usd.Stage.CreateNew(str(tmp_path / "a.usda")), "/mesh")
    np.savez(tmp_path / "a.npz", vertices=CORNER)
    for name in ("a.vtu", "a.usda", "a.npz"):
        with pytest.raises(MeshError, match=name):
            TetMesh.load(tmp_path / name)


def test_a_reordered_mesh_is_the_same_shape_with_its_neighbours_close(mesh, rng):
    shuffle = rng.permutation(len(mesh.vertices))
    where = np.argsort(shuffle)
    tets = where[mesh.tets][rng.permutation(len(mesh.tets))]
    before = TetMesh(mesh.vertices[shuffle], tets)
    after, order = before.reordered()
    assert sorted(order) == list(range(len(mesh.vertices)))
    assert np.array_equal(after.vertices, before.vertices[order])
    same = order[after.tets]  # in the old numbers
    assert {frozenset(t) for t in same.tolist()} == {frozenset(t) for t in before.tets.tolist()}
    assert (after.volumes > 0.0).all()

    def jumps(m):
        return np.ptp(m.tets, axis=1).mean()

    # Shuffled, the ids of a tet are spread over 3/5 of all; a curve through 60 vertices keeps most
    # neighbours within a third.
    assert jumps(after) < 0.6 * jumps(before)
    assert (np.diff(after.tets.min(axis=1)) >= 0).all()


def test_codes_follow_a_z_order_curve():
    corners = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)], dtype=float)
    assert (np.diff(topology.morton_codes(corners).astype(np.int64)) > 0).all()
    assert (topology.morton_codes(np.ones((3, 3))) == 0).all()
    # In every cube of cells the curve stays until all of it was visited.
    x = np.random.default_rng(SEED).uniform(size=(500, 3))
    octant = (x > 0.5) @ [1, 2, 4]
    x[0], x[1] = 0.0, 1.0  # the box
    octant[:2] = 0, 7
    along = octant[np.argsort(topology.morton_codes(x))]
    assert (np.diff(along) >= 0).all()


def test_usd_that_stands_on_its_side_is_turned_so_that_z_is_up(tmp_path):
    tall = box((0.1, 0.2, 0.6), 1)
    stage = Usd.Stage.CreateNew(str(tmp_path / "y_up.usda"))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    prim = UsdGeom.TetMesh.Define(stage, "/tall")
    x, y, z = tall.vertices.T
    prim.CreatePointsAttr(np.stack([x, z, -y], axis=1).tolist())  # y is up, a right-handed frame
    prim.CreateTetVertexIndicesAttr(tall.tets.tolist())
    stage.Save()
    found = TetMesh.load(tmp_path / "y_up.usda")
    np.testing.assert_allclose(found.vertices, tall.vertices, atol=1e-7)  # float32
    np.testing.assert_array_equal(found.tets, tall.tets)
