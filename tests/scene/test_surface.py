"""surface.py: surfaces, and what they enclose."""

import numpy as np
import pytest

import warp_contact as wc

MESH = wc.sphere(0.1, 147)


def surface_of(mesh: wc.TetMesh) -> wc.Surface:
    return wc.Surface(mesh.vertices, mesh.surface)


def test_what_a_surface_encloses_has_the_volume_and_the_inertia_of_its_tets(rng):
    mesh = wc.box((0.2, 0.1, 0.3), (2, 1, 3)).transformed(
        rng.normal(size=(3, 3)), rng.normal(size=3)
    )
    surface, solid = surface_of(mesh), wc.Rigid(700.0).solid(mesh.vertices, mesh.tets)
    found = surface.rigid(700.0)
    assert surface.is_closed and surface.volume == pytest.approx(mesh.volume, rel=1e-12)
    assert found.mass == pytest.approx(solid.mass, rel=1e-12)
    np.testing.assert_allclose(found.centre, solid.centre, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.inertia, solid.inertia, rtol=1e-9, atol=1e-12)


def test_an_open_surface_or_one_turned_inside_out_encloses_nothing():
    with pytest.raises(wc.MeshError, match="not closed encloses nothing"):
        wc.Surface(MESH.vertices, MESH.surface[1:]).rigid(1000.0)
    with pytest.raises(wc.MeshError, match="inside out: then turn its triangles"):
        wc.Surface(MESH.vertices, MESH.surface[:, ::-1]).rigid(1000.0)
    with pytest.raises(ValueError, match="density 0: give a number above 0"):
        surface_of(MESH).rigid(0)


def test_a_surface_can_be_placed_and_mirrored(rng):
    uv, normals = rng.random((48, 3, 2)), rng.normal(size=(48, 3, 3))
    box = wc.box(1.0, 2)
    surface = wc.Surface(box.vertices, box.surface, uv, normals)
    other = surface.transformed(np.diag([-2.0, 1.0, 1.0]), (1.0, 0.0, 0.0))
    assert other.volume == pytest.approx(2.0)
    np.testing.assert_array_equal(other.uv, uv[:, ::-1][:, [2, 0, 1]])
    np.testing.assert_allclose(other.vertices[:, 0], 1.0 - 2.0 * box.vertices[:, 0])
    # A normal stays at right angles to what lay in its surface.
    along = rng.normal(size=3)
    flat = np.cross(normals[0, 0], along) @ np.diag([-2.0, 1.0, 1.0])
    assert other.normals[0, 0] @ flat == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(other.normals, axis=2) == pytest.approx(1.0)


def test_cracks_are_closed_by_a_tolerance(rng):
    soup = MESH.vertices[MESH.surface].reshape(-1, 3)
    tris, colors = np.arange(len(soup)).reshape(-1, 3), rng.random((len(soup), 3))
    soup += rng.uniform(-1e-6, 1e-6, soup.shape)
    cracked = wc.Surface(soup, tris, colors=colors)
    whole = cracked.welded(1e-5)
    assert not cracked.is_closed
    assert whole.is_closed and whole.volume == pytest.approx(MESH.volume, rel=1e-3)
    assert whole.colors.shape == whole.vertices.shape
    with pytest.raises(wc.MeshError, match="no triangle is larger than 1 m"):
        wc.Surface(np.eye(3), [[0, 1, 2]]).transformed(0.1 * np.eye(3)).welded(1.0)


def test_a_texture_and_colours_are_checked(tmp_path):
    square = np.eye(3), [[0, 1, 2]]
    with pytest.raises(ValueError, match=r"texture 'a\.txt': give a picture, one of .png"):
        wc.Surface(*square, texture=tmp_path / "a.txt")
    with pytest.raises(FileNotFoundError, match=r"no such texture: .*a\.png"):
        wc.Surface(*square, texture=tmp_path / "a.png")
    with pytest.raises(ValueError, match="give linear red, green and blue from 0 to 1"):
        wc.Surface(*square, colors=(0.0, 255.0, 0.0))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((np.zeros((3, 2)), [[0, 1, 2]]), "give numbers of shape"),
        ((np.eye(3), [[0.0, 1.0, 2.0]]), "give whole numbers of shape"),
        ((np.eye(3), [[0, 1, 3]]), r"triangle 0 is \[0, 1, 3\]: index outside 0..2"),
        ((np.eye(3), [[0, 1, 1]]), "triangle 0 repeats a vertex"),
        ((np.full((3, 3), np.inf), [[0, 1, 2]]), "vertex 0 is not finite"),
        ((np.eye(3), [[0, 1, 2]], np.zeros((9, 2))), "uv of shape"),
        (([[0, 0], [1]], [[0, 1, 2]]), "give numbers of shape"),
    ],
)
def test_what_is_no_surface_is_refused(given, words):
    with pytest.raises(ValueError, match=words):
        wc.Surface(*given)
