"""files.py and reading.py: what is taken from files, and what is refused with its reason."""

import io
import os
import pickle
import struct
import warnings
import zipfile

import numpy as np
import pytest

from warp_contact import MeshError, TetMesh, box
from warp_contact.scene import files

MESH = box(1.0, 2)
CORNER = "[(0,0,0), (1,0,0), (0,1,0), (0,0,1)]"
USD = """#usda 1.0
(
    metersPerUnit = {unit}
{meta})
def TetMesh "mesh" {arc}
{{
    point3f[] points = {points}
    int4[] tetVertexIndices = {tets}
{more}}}
"""
VTK = """# vtk DataFile Version 4.2
x
ASCII
DATASET UNSTRUCTURED_GRID
POINTS {n} double
0 0 0 1 0 0 0 1 0 0 0 1
CELLS {m} {size}
4 0 1 2 {last}
CELL_TYPES 1
10
"""


def header(shape: tuple, kind: str) -> bytes:
    """Of an array in an .npz."""
    text = f"{{'descr': {kind!r}, 'fortran_order': False, 'shape': {shape!r}, }}"
    text += " " * (63 - (len(text) + 10) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


def archive(path, vertices: bytes, tets: bytes) -> None:
    """An .npz of raw members."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("vertices.npy", vertices)
        file.writestr("tets.npy", tets)


ARRAYS = {
    "complex": ({"vertices": MESH.vertices + 0j}, "numbers of shape"),
    "byte strings": ({"vertices": MESH.vertices.astype("S8")}, "numbers of shape"),
    "texts": ({"vertices": MESH.vertices.astype(str)}, "numbers of shape"),
    "dates": ({"vertices": np.zeros(MESH.vertices.shape, "M8[s]")}, "numbers of shape"),
    "objects": ({"vertices": MESH.vertices.astype(object)}, "numbers of shape"),
    "booleans": ({"tets": MESH.tets > 0}, "whole numbers of shape"),
    "real ids": ({"tets": MESH.tets.astype(float)}, "whole numbers of shape"),
    "triangles": ({"tets": MESH.tets[:, :3]}, r"whole numbers of shape \(n, 4\)"),
    "a huge id": ({"tets": MESH.tets.astype("u8") + 2**32}, "index outside 0..26"),
    "not finite": ({"vertices": MESH.vertices * np.nan}, "vertex 0 is not finite"),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_an_npz_of_other_arrays_is_refused_with_its_reason(name, tmp_path):
    given, words = ARRAYS[name]
    np.savez(tmp_path / "a.npz", **{"vertices": MESH.vertices, "tets": MESH.tets} | given)
    with pytest.raises(MeshError, match=words) as caught:
        TetMesh.load(tmp_path / "a.npz")
    assert str(tmp_path / "a.npz") in str(caught.value)


def test_an_npz_that_declares_more_than_it_holds_is_refused_before_it_is_read(tmp_path):
    path, one = tmp_path / "a.npz", header((1, 4), "<i4") + np.arange(4, dtype="<i4").tobytes()
    archive(path, header((10**12, 3), "<f8"), one)
    with pytest.raises(MeshError, match="'vertices' is not as long as it says"):
        TetMesh.load(path)
    archive(path, header((-1, 3), "<f8"), one)
    with pytest.raises(MeshError, match="damaged"):
        TetMesh.load(path)


def test_a_zip_bomb_is_refused_by_the_size_that_it_declares(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "BYTES", 10**6)
    zeros = np.zeros((10**5, 3))
    np.savez_compressed(tmp_path / "a.npz", vertices=zeros, tets=MESH.tets)
    with pytest.raises(MeshError, match="'vertices' has 2400128 bytes, more than 1000000"):
        TetMesh.load(tmp_path / "a.npz")


def test_nothing_in_a_file_is_executed(tmp_path):
    class Evil:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "evil"),)

    (tmp_path / "a.npz").write_bytes(pickle.dumps(Evil()))
    np.savez(tmp_path / "b.npz", vertices=np.array([Evil()], dtype=object), tets=MESH.tets)
    for name in "a.npz", "b.npz":
        with pytest.raises(MeshError, match=name):
            TetMesh.load(tmp_path / name)
    assert not (tmp_path / "evil").exists()


def usda(path, unit="1", meta="", arc="", points=CORNER, tets="[(0,1,2,3)]", more=""):
    """A stage with one tet, some of it replaced."""
    given = {"unit": unit, "meta": meta, "arc": arc, "points": points, "tets": tets, "more": more}
    path.write_text(USD.format(**given))
    return path


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"unit": "-1"}, "its metersPerUnit is -1.0: write a number above zero"),
        ({"unit": "0"}, "its metersPerUnit is 0.0"),
        ({"unit": "inf"}, "its metersPerUnit is inf"),
        ({"unit": '"a"'}, "is not a readable USD file"),
        ({"points": "[(0,0,0), 7]"}, "is not a readable USD file"),
        ({"points": "[]"}, "has no points or no tets"),
        ({"tets": "[(0,1,2,-3)]"}, "tet 0 is .*index outside"),
        ({"tets": "[(0,1,2,2147483647)]"}, "tet 0 is .*index outside"),
        ({"points": "[(nan,0,0), (1,0,0), (0,1,0), (0,0,1)]"}, "vertex 0 is not finite"),
        (
            {
                "more": "    matrix4d xformOp:transform = "
                "((1,0,0,5),(0,1,0,0),(0,0,1,0),(0,0,0,0))\n"
                '    uniform token[] xformOpOrder = ["xformOp:transform"]\n'
            },
            "the transform of /mesh is not affine",
        ),
    ],
)
def test_damaged_usd_is_refused_with_its_reason_in_one_line(given, words, tmp_path):
    path = usda(tmp_path / "a.usda", **given)
    with pytest.raises(MeshError, match=words) as caught:
        TetMesh.load(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "given",
    [
        {"meta": "    subLayers = [@./a.usda@]\n"},
        {"meta": "    startTimeCode = 0\n    endTimeCode = 1e18\n"},
        {"arc": "(prepend references = @./a.usda@</mesh>)"},
        {"arc": "(payload = @./nothing.usda@)"},
    ],
)
def test_usd_that_names_itself_or_what_is_not_there_does_not_hang(given, tmp_path):
    assert TetMesh.load(usda(tmp_path / "a.usda", **given)).volume == pytest.approx(1.0 / 6.0)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"last": -1}, "a tetra names a vertex that the file does not hold"),
        ({"last": 99}, "a tetra names vertex 99 of 4"),
        ({"last": 2**63}, "a.vtk"),
        ({"n": 10**18}, "a.vtk"),
        ({"n": -4}, "a.vtk"),
        ({"m": 10**9, "size": 5 * 10**9}, "a.vtk"),
        ({"m": 0, "size": 0}, "a.vtk"),
    ],
)
def test_a_damaged_vtk_is_refused(given, words, tmp_path):
    pytest.importorskip("meshio")
    (tmp_path / "a.vtk").write_text(VTK.format(**{"n": 4, "m": 1, "size": 5, "last": 3} | given))
    with pytest.raises(MeshError, match=words):
        TetMesh.load(tmp_path / "a.vtk")


@pytest.mark.parametrize("last", [0, -1, 5, 99])
@pytest.mark.parametrize("version", ["gmsh22", "gmsh"])
def test_a_gmsh_file_that_names_another_node_is_refused(last, version, tmp_path):
    meshio = pytest.importorskip("meshio")
    x = np.concatenate([[[0.0, 0.0, 0.0]], np.eye(3)])
    path = tmp_path / "a.msh"
    meshio.write(path, meshio.Mesh(x, [("tetra", [[0, 1, 2, 3]])]), version, binary=False)
    assert TetMesh.load(path).volume == pytest.approx(1.0 / 6.0)
    head, words, tail = path.read_text().partition("$Elements")
    path.write_text(head + words + tail.replace("1 2 3 4", f"1 2 3 {last}"))
    with pytest.raises(MeshError, match=r"a\.msh: "):
        TetMesh.load(path)


def test_what_is_no_regular_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.usda")
    with pytest.raises(OSError, match="no file but a pipe or a device"):
        TetMesh.load(tmp_path / "pipe.usda")
    with pytest.raises(IsADirectoryError, match="is a folder"):
        TetMesh.load(tmp_path)


def test_a_reader_that_hangs_or_dies_is_ended(tmp_path, monkeypatch):
    pytest.importorskip("meshio")
    MESH.save(tmp_path / "a.vtk")
    own = tmp_path / "reading.py"
    monkeypatch.setattr(files.reading, "__file__", str(own))
    own.write_text("import time\ntime.sleep(1000)")
    monkeypatch.setattr(files, "SECONDS", (0.5, 0.0))
    with pytest.raises(MeshError, match=r"a\.vtk: reading it took more than 0 s"):
        TetMesh.load(tmp_path / "a.vtk")
    monkeypatch.setattr(files, "SECONDS", (60.0, 0.0))
    own.write_text("import os\nos.abort()")
    with pytest.raises(
        MeshError, match=r"a\.vtk: the reader of '\.vtk' files broke down"
    ) as caught:
        TetMesh.load(tmp_path / "a.vtk")
    assert caught.value.__cause__ is not None


def test_a_reader_that_asks_for_all_memory_gets_none(tmp_path, monkeypatch):
    pytest.importorskip("resource")
    pytest.importorskip("meshio")
    (tmp_path / "a.vtk").write_text(VTK.format(n=10**9, m=1, size=5, last=3))
    with pytest.raises(MeshError, match=r"a\.vtk"):
        TetMesh.load(tmp_path / "a.vtk")
    monkeypatch.setattr(files, "MEMORY", (3 * 10**8, 0))
    path = usda(tmp_path / "a.usda", more='    string a = "' + "x" * 10**8 + '"\n')
    with pytest.raises(MeshError, match=r"a\.usda: (asks for more memory|.*broke down)"):
        TetMesh.load(path)


def test_a_unit_scales_files_that_have_none(tmp_path):
    bunny = box((60.0, 85.0, 70.0), 2)
    for name in "a.npz", "a.vtu":
        pytest.importorskip("meshio")
        bunny.save(tmp_path / name)
        with pytest.warns(UserWarning, match=rf"{name}: 85 m large.*unit=1e-3 reads millimetres"):
            TetMesh.load(tmp_path / name)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            small = TetMesh.load(tmp_path / name, unit=1e-3)
            assert TetMesh.load(tmp_path / name, unit=1.0).volume == pytest.approx(bunny.volume)
        np.testing.assert_allclose(small.vertices, 1e-3 * bunny.vertices, rtol=1e-14)
    bunny.save(tmp_path / "a.usda")
    assert TetMesh.load(tmp_path / "a.usda").volume == pytest.approx(bunny.volume, rel=1e-6)
    with pytest.raises(ValueError, match=r"says its unit itself; leave unit=0\.001 out"):
        TetMesh.load(tmp_path / "a.usda", unit=1e-3)


def test_hexes_and_cells_of_second_order_are_read(tmp_path):
    meshio = pytest.importorskip("meshio")
    cube = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    x = np.concatenate([cube, cube + [0, 0, 1]])
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(x, [("hexahedron", np.arange(8)[None])]))
    assert TetMesh.load(tmp_path / "a.vtu").volume == pytest.approx(1.0)
    corner = np.concatenate([[[0.0, 0.0, 0.0]], np.eye(3)])
    pairs = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
    x = np.concatenate([corner, [(corner[i] + corner[j]) / 2.0 for i, j in pairs]])
    meshio.write(tmp_path / "b.vtu", meshio.Mesh(x, [("tetra10", np.arange(10)[None])]))
    mesh = TetMesh.load(tmp_path / "b.vtu")
    assert len(mesh.vertices) == 4 and mesh.volume == pytest.approx(1.0 / 6.0)


@pytest.mark.parametrize("name", ["a.stl", "a.obj", "a.ply"])
def test_a_surface_is_refused_with_a_way_to_fill_it(name, tmp_path):
    meshio = pytest.importorskip("meshio")
    surface = meshio.Mesh(MESH.vertices, [("triangle", MESH.surface)])
    meshio.write(tmp_path / name, surface)
    words = rf"{name}: holds no tets, only 48 triangle; fill it first.*pip install pytetwild"
    with pytest.raises(MeshError, match=words):
        TetMesh.load(tmp_path / name)
    with pytest.raises(MeshError, match=r"holds no tets; write \.npz"):
        MESH.save(tmp_path / name)


def test_a_format_is_known_by_its_ending_in_any_case(tmp_path):
    data = io.BytesIO()
    np.savez(data, vertices=MESH.vertices, tets=MESH.tets)
    (tmp_path / "A.NPZ").write_bytes(data.getvalue())
    assert len(TetMesh.load(tmp_path / "A.NPZ").tets) == len(MESH.tets)
