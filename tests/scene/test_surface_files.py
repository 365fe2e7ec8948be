"""surface_files.py and reading_faces.py: surfaces in STL, OBJ, PLY and USD files."""

import warnings

import numpy as np
import pytest

import warp_contact as wc
from warp_contact.scene import files, reading_faces

MESH = wc.sphere(0.1, 147)
USD = """#usda 1.0
(
    {meta}
)
def Xform "world" {{
    {placed}
    def Mesh "first" {{
        int[] faceVertexCounts = {counts}
        int[] faceVertexIndices = {indices}
        point3f[] points = {points}
        {more}
    }}
}}
"""
SQUARE = "[(0,0,0), (2,0,0), (2,1,0), (0,1,0)]"
PLACED = 'double3 xformOp:translate = (0,0,5)\n    uniform token[] xformOpOrder = ["xformOp:'


def read_here(kind: str, path, argument: str = "", size=None) -> bytes:
    """What the program that reads would answer, without its start of half a second."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # as it does
        said = reading_faces.reading.answer(kind, str(path), argument)
    if said[:1] == b"-":
        raise wc.MeshError(f"{path}: {said[1:].decode()}")
    return said[1:]


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Read in this process; ``test_shells.py`` and ``usd/test_skin.py`` do as users do."""
    monkeypatch.setattr(files, "in_child", read_here)


def usda(path, **given):
    """A stage with a square of one polygon, some of it replaced."""
    square = {"meta": "", "placed": "", "counts": "[4]", "indices": "[0,1,2,3]", "more": ""}
    path.write_text(USD.format(**square | {"points": SQUARE} | given))
    return path


@pytest.mark.parametrize("name", ["a.stl", "a.obj", "a.ply", "a.vtk"])
def test_surface_files_are_read(name, tmp_path):
    meshio = pytest.importorskip("meshio")
    meshio.write(tmp_path / name, meshio.Mesh(MESH.vertices, [("triangle", MESH.surface)]))
    found = wc.Surface.load(tmp_path / name, unit=1e-3)
    assert len(found.vertices) == len(np.unique(MESH.surface)) and found.is_closed
    # STL holds float32.
    assert found.volume == pytest.approx(1e-9 * MESH.volume, rel=1e-6)


def test_an_obj_has_uv_and_normals_of_its_corners_and_polygons(tmp_path):
    (tmp_path / "a.obj").write_text(
        "# a square and a triangle\nmtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0 1.0\n"
        "vt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.5 0\nvn 0 0 2\no one\ns off\n"
        "f 1/1/1 2/2/1 3/3/1 \\\n 4/4/1\nv 0 0 1\nf -1/-1/-1 -5/1/1 -4/2/1\n"
    )
    found = wc.Surface.load(tmp_path / "a.obj")
    assert found.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [4, 0, 1]]
    np.testing.assert_array_equal(found.uv[1], [[0, 0], [1, 1], [0.5, 0.5]])
    np.testing.assert_array_equal(found.uv[2], [[0.5, 0.5], [0, 0], [1, 0]])
    np.testing.assert_array_equal(found.normals, np.tile([0.0, 0.0, 1.0], (3, 3, 1)))


def test_a_ply_of_any_age_has_uv_and_normals(tmp_path):
    pytest.importorskip("meshio")
    names = "".join(f"property float {n}\n" for n in ("x", "y", "z", "nx", "ny", "nz", "s", "t"))
    rows = "0 0 0 0 0 1 0 0\n1 0 0 0 0 1 1 0\n1 1 0 0 0 1 1 1\n0 1 0 0 0 1 0 1\n"
    for faces in "vertex_index", "vertex_indices":
        (tmp_path / "a.ply").write_text(
            f"ply\nformat ascii 1.0\nelement vertex 4\n{names}element face 1\n"
            f"property list uchar int {faces}\nend_header\n{rows}4 0 1 2 3\n"
        )
        found = wc.Surface.load(tmp_path / "a.ply")
        np.testing.assert_array_equal(found.uv, found.vertices[found.triangles][:, :, :2])
        assert found.normals[:, :, 2].min() == 1.0 and len(found.triangles) == 2


def test_an_obj_of_one_material_has_its_colour_and_texture(tmp_path):
    square = "mtllib looks/a b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl the skin\nf 1 2 3\n"
    (tmp_path / "a.obj").write_text(square)
    assert wc.Surface.load(tmp_path / "a.obj").texture is None  # no library
    (tmp_path / "looks").mkdir()
    library = "newmtl other\nKd 1 1 1\nnewmtl the skin\nKd 0.5 0.25 0\nmap_Kd -s 1 1 1 p.png\n"
    (tmp_path / "looks/a b.mtl").write_text(library)
    with pytest.warns(UserWarning, match=r"its texture .*p\.png is left out: no such picture"):
        found = wc.Surface.load(tmp_path / "a.obj")
    assert found.texture is None and found.colors.tolist() == [0.5, 0.25, 0.0]
    (tmp_path / "looks/p.png").write_bytes(b"any")
    assert wc.Surface.load(tmp_path / "a.obj").texture == tmp_path / "looks/p.png"
    (tmp_path / "a.obj").write_text(square + "usemtl other\nf 3 2 1\n")
    two = wc.Surface.load(tmp_path / "a.obj")
    assert two.texture is None and two.colors is None


def test_colours_of_vertices_are_read(tmp_path):
    pytest.importorskip("meshio")
    names = "".join(f"property float {n}\n" for n in "xyz")
    names += "".join(f"property uchar {n}\n" for n in ("red", "green", "blue"))
    (tmp_path / "a.ply").write_text(
        f"ply\nformat ascii 1.0\nelement vertex 4\n{names}element face 1\nproperty list uchar int "
        f"vertex_indices\nend_header\n9 9 9 9 9 9\n0 0 0 255 0 0\n1 0 0 0 188 0\n0 1 0 0 0 0\n"
        f"3 1 2 3\n"
    )
    wanted = [[1.0, 0.0, 0.0], [0.0, 0.5029, 0.0], [0.0, 0.0, 0.0]]  # 188 of sRGB is half as bright
    np.testing.assert_allclose(wc.Surface.load(tmp_path / "a.ply").colors, wanted, atol=1e-4)
    more = "color3f[] primvars:displayColor = {}"
    constant = more.format("[(0.1,0.2,0.3)]")
    found = wc.Surface.load(usda(tmp_path / "a.usda", more=constant))
    np.testing.assert_allclose(found.colors, [0.1, 0.2, 0.3], atol=1e-6)
    each = more.format("[(1,0,0),(0,1,0),(0,0,1),(1,1,1)]") + ' (interpolation = "vertex")'
    found = wc.Surface.load(usda(tmp_path / "a.usda", more=each))
    np.testing.assert_array_equal(found.colors[:3], np.eye(3))


def test_vertices_in_the_same_place_become_one_and_flat_triangles_go(tmp_path):
    soup = MESH.vertices[MESH.surface].reshape(-1, 3)
    lines = [f"v {x} {y} {z}" for x, y, z in soup.tolist()]
    lines += [f"f {k} {k + 1} {k + 2}" for k in range(1, len(soup), 3)] + ["f 1 1 2"]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    found = wc.Surface.load(tmp_path / "a.obj")
    assert found.is_closed and len(found.triangles) == len(MESH.surface)


def test_a_mesh_of_usd_is_read_as_it_is_placed(tmp_path):
    st = 'texCoord2f[] primvars:st = [(0,0),(1,0),(1,1),(0,1)] (interpolation = "{}")'
    meta = 'metersPerUnit = 0.01\n    upAxis = "Y"'
    placed = PLACED + 'translate"]'
    for where in "faceVarying", "vertex":
        path = usda(tmp_path / "a.usda", meta=meta, placed=placed, more=st.format(where))
        found = wc.Surface.load(path)
        # (x, y, z) in centimetres with y up is (x, -z, y).
        corner = [[0, -0.05, 0], [0.02, -0.05, 0], [0.02, -0.05, 0.01], [0, -0.05, 0.01]]
        np.testing.assert_allclose(found.vertices, corner, atol=1e-9)
        np.testing.assert_allclose(found.areas.sum(axis=0), [0.0, -2e-4, 0.0], atol=1e-12)
        np.testing.assert_array_equal(found.uv[1], [[0, 0], [1, 1], [0, 1]])
    with pytest.raises(ValueError, match="leave unit=2 out"):
        wc.Surface.load(path, unit=2)
    named = wc.Surface.load(path, prim="/world/first")
    np.testing.assert_array_equal(named.vertices, found.vertices)


@pytest.mark.parametrize(
    "given",
    [
        {"more": 'uniform token orientation = "leftHanded"'},
        {"placed": PLACED.replace("translate = (0,0,5)", "scale = (1,1,-1)") + 'scale"]'},
    ],
)
def test_what_is_mirrored_in_usd_is_turned(given, tmp_path):
    found = wc.Surface.load(usda(tmp_path / "a.usda", **given))
    np.testing.assert_allclose(found.areas.sum(axis=0), [0.0, 0.0, -2.0])


CACHE = """point3f[] points.timeSamples = {{
            10: [(0,0,0), (1,0,0), (1,1,0), (0,1,0)],
            {second}
        }}"""


def moving(path, second="14: [(0,0,2), (1,0,2), (1,1,2), (0,1,2)],", **given):
    meta = "timeCodesPerSecond = 24\nmetersPerUnit = 1"
    text = USD.replace("        point3f[] points = {points}\n", "")
    square = {"counts": "[4]", "indices": "[3,0,1,2]", "placed": "", "meta": meta}
    path.write_text(text.format(**square | {"more": CACHE.format(second=second)} | given))
    return path


def test_frames_of_a_cache_are_those_of_its_surface(tmp_path):
    placed = "double3 xformOp:translate.timeSamples = {10: (0,0,0), 14: (8,0,0)}\n"
    path = moving(
        tmp_path / "a.usda", placed=placed + 'uniform token[] xformOpOrder=["xformOp:translate"]'
    )
    surface, frames = wc.Surface.load(path), wc.Surface.load_frames(path, fps=48)
    assert frames.shape == (9, 4, 3)  # a sixth of a second
    np.testing.assert_allclose(frames[0], surface.vertices, atol=1e-6)
    for k, x in enumerate(frames):
        np.testing.assert_allclose(x, surface.vertices + [k, 0.0, 0.25 * k], atol=1e-6)
    assert wc.Surface.load_frames(path, fps=60).shape[0] == 11
    np.testing.assert_array_equal(surface.moved(frames[3]).triangles, surface.triangles)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"second": "14: [(0,0,2), (1,0,2)],"}, "has no points, or not always as many"),
        ({"counts": "[4]\nint[] faceVertexCounts.timeSamples = {10: [4], 14: [4]}"}, "change"),
    ],
)
def test_a_cache_of_changing_faces_is_refused(given, words, tmp_path):
    with pytest.raises(wc.MeshError, match=words):
        wc.Surface.load_frames(moving(tmp_path / "a.usda", **given))


def test_only_what_moves_has_frames(tmp_path):
    with pytest.raises(wc.MeshError, match="/world/first does not move"):
        wc.Surface.load_frames(usda(tmp_path / "a.usda"))
    with pytest.raises(ValueError, match="only a USD file holds frames"):
        wc.Surface.load_frames(tmp_path / "a.obj")
    with pytest.raises(ValueError, match="fps 0: give a number above 0"):
        wc.Surface.load_frames(tmp_path / "a.usda", fps=0)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "a face names vertex 8 of 3"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "a face names vertex -1 of 3"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "line 4 cannot be read: 'f 1 2'"),
        ("a.obj", "v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n", "lacks a number"),
        ("a.obj", "v 0 0 zero\n", "line 1 cannot be read"),
        ("a.obj", "v 0 0 0\n", "holds no faces, only points"),
        ("a.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "vertex 0 is not finite"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2 2\n", "each of its faces repeats a vertex"),
        ("a.stl", "solid nothing\n", r"a\.stl: "),
        ("a.stl", "facet normal 0 0 1\nvertex 0 0 zero\n", "damaged, or its name has the wrong"),
        ("a.ply", "ply\nformat ascii 2.0\n", r"a\.ply: "),
        ("a.xyzzy", "1", "its name has no ending that meshio knows"),
        ("a.npz", "1", "holds no surface: give the arrays to wc.Surface"),
        ("a.usda", "#usda 1.0\n", "holds no Mesh"),
        ("a.usda", "usda", "is not a readable USD file"),
    ],
)
def test_bad_files_are_refused_in_one_line(name, text, words, tmp_path):
    pytest.importorskip("meshio")
    (tmp_path / name).write_text(text)
    with pytest.raises(wc.MeshError, match=words) as caught:
        wc.Surface.load(tmp_path / name)
    assert name in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "given",
    [
        {"counts": "[3]"},
        {"counts": "[-1, 5]"},
        {"indices": "[0,1,2,7]"},
        {"points": "[]"},
        {"points": "[(nan,0,0), (1,0,0), (1,1,0), (0,1,0)]"},
    ],
)
def test_a_damaged_mesh_of_usd_is_refused(given, tmp_path):
    with pytest.raises(wc.MeshError, match=r"a\.usda"):
        wc.Surface.load(usda(tmp_path / "a.usda", **given))


def test_a_file_of_tets_names_what_reads_it(tmp_path):
    pytest.importorskip("meshio")
    wc.box(0.1, 1).save(tmp_path / "a.vtu")
    with pytest.raises(wc.MeshError, match="holds no faces, only 5 tetra"):
        wc.Surface.load(tmp_path / "a.vtu")


def test_meshio_is_asked_for_where_it_is_needed(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "meshio", None)
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert len(wc.Surface.load(tmp_path / "a.obj").triangles) == 1
    (tmp_path / "a.stl").write_text("solid")
    with pytest.raises(wc.MeshError, match=r"pip install 'warp_contact\[mesh\]'"):
        wc.Surface.load(tmp_path / "a.stl")


def test_a_unit_is_asked_for(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n")
    with pytest.warns(UserWarning, match=r"100 m large.*unit=1e-3 reads millimetres"):
        wc.Surface.load(tmp_path / "a.obj")


@pytest.mark.parametrize("name", ["a.obj", "a.usda"])
def test_who_loads_tets_from_a_surface_is_told_of_shells(name, tmp_path):
    pytest.importorskip("meshio")
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    usda(tmp_path / "a.usda")
    with pytest.raises(wc.MeshError, match=r"wc\.Surface\.load") as error:
        wc.TetMesh.load(tmp_path / name)
    assert "wc.shell" in str(error.value)
