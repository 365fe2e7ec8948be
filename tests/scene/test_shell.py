"""shell.py: shells of tets on surfaces and height fields."""

import numpy as np
import pytest

import warp_contact as wc

SIDES = "outside", "inside", "both"


def surface_of(mesh: wc.TetMesh) -> wc.Surface:
    return wc.Surface(mesh.vertices, mesh.surface)


def sheet(n: int, z=lambda x, y: 0.0 * x) -> wc.Surface:
    """A square of edge 1 about the origin, n cells along each side, seen from above."""
    along = np.linspace(-0.5, 0.5, n + 1)
    x, y = np.meshgrid(along, along, indexing="ij")
    ids = np.arange(x.size).reshape(x.shape)
    a, b, c, d = ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]
    tris = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
    return wc.Surface(np.stack([x, y, z(x, y)], axis=-1).reshape(-1, 3), tris.reshape(-1, 3))


@pytest.mark.parametrize("side", SIDES)
def test_about_edges_and_corners_a_shell_is_as_thick_as_on_faces(side, rng):
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    box = wc.box((0.3, 0.2, 0.1), 2).transformed(turn)
    mesh = wc.shell(surface_of(box), 0.01, side)
    outer, inner = {"outside": (0.01, 0.0), "inside": (0.0, -0.01), "both": (0.005, -0.005)}[side]
    size = np.array([0.3, 0.2, 0.1])
    volume = np.prod(size + 2.0 * outer) - np.prod(size + 2.0 * inner)
    assert mesh.volume == pytest.approx(volume, rel=1e-9)
    half = np.abs(mesh.vertices @ turn).max(axis=0)
    np.testing.assert_allclose(half, 0.5 * size + outer, rtol=1e-12)
    n = len(mesh.vertices) // 2  # below, then above
    below = np.abs(mesh.vertices[:n] @ turn).max(axis=0)
    np.testing.assert_allclose(below, 0.5 * size + inner, rtol=1e-12)


@pytest.mark.parametrize("side", SIDES)
def test_a_shell_of_a_smooth_surface_is_everywhere_as_thick_as_asked(side):
    ball = wc.sphere(0.1, 1500)
    mesh = wc.shell(surface_of(ball), 0.01, side)
    n = len(mesh.vertices) // 2
    apart = np.linalg.norm(mesh.vertices[n:] - mesh.vertices[:n], axis=1)
    # Facets lean by a tenth, whose cosine is 0.995.
    assert 0.01 * (1.0 - 1e-6) < apart.min() and apart.max() < 0.0103
    assert mesh.n_pieces == 1 and mesh.quality.min() > 0.1


def test_outside_is_outside_of_a_closed_surface_however_its_triangles_turn():
    box = surface_of(wc.box(0.2, 2))
    turned = wc.Surface(box.vertices + [0.0, 0.0, 5.0], box.triangles[:, [0, 2, 1]])
    for side in SIDES:
        one, other = wc.shell(box, 0.01, side), wc.shell(turned, 0.01, side)
        assert other.volume == pytest.approx(one.volume, rel=1e-9)
        np.testing.assert_allclose(other.vertices - [0.0, 0.0, 5.0], one.vertices, atol=1e-12)


def test_an_open_surface_is_kept_on_one_side():
    surface = sheet(4, lambda x, y: 0.1 * x * x)
    for side, first in ("outside", 0), ("inside", 1):
        mesh, n = wc.shell(surface, 0.02, side), len(surface.vertices)
        np.testing.assert_array_equal(mesh.vertices[first * n :][:n], surface.vertices)
        assert mesh.volume == pytest.approx(0.02, rel=0.01)  # its area is 1.0033
    other = wc.shell(surface.moved(surface.vertices + [0.0, 0.0, 0.3]), 0.02, "inside")
    np.testing.assert_array_equal(other.tets, mesh.tets)  # so positions of one suit the other
    np.testing.assert_allclose(other.vertices, mesh.vertices + [0.0, 0.0, 0.3], atol=1e-12)


def test_what_bends_too_sharply_is_refused_with_what_works():
    ball = surface_of(wc.sphere(0.1, 147))
    wc.shell(ball, 1.0, "outside")
    with pytest.raises(wc.MeshError, match=r"triangle \d+ would turn inside out") as caught:
        wc.shell(ball, 0.2, "inside")
    most = float(str(caught.value).partition("follow; ")[2].split()[0])
    assert 0.05 < most < 0.1
    wc.shell(ball, 0.99 * most, "inside")
    with pytest.raises(wc.MeshError, match=f"{most:g} m is the largest thickness"):
        wc.shell(ball, 1.01 * most, "inside")


def test_a_crease_that_folds_back_is_refused():
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.9, 0]], dtype=float)
    with pytest.raises(wc.MeshError, match="no thickness works: the surface folds back"):
        wc.shell(wc.Surface(x, [[0, 1, 2], [1, 0, 3]]), 0.01)


@pytest.mark.parametrize(
    ("tris", "words"),
    [
        ([[0, 1, 2], [0, 1, 3]], "triangles 0 and 1 both go along the edge from vertex 0 to 1"),
        ([[0, 1, 2], [1, 0, 3], [0, 1, 4]], "triangles 0 and 2 both go along the edge"),
        ([[0, 1, 2], [0, 3, 4]], "vertex 0: its triangles form several fans"),
        ([[0, 1, 5]], "triangle 0 has no area"),
    ],
)
def test_what_is_no_sheet_is_refused(tris, words):
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0.1], [-1, 0, 0.3], [2, 0, 0]])
    with pytest.raises(wc.MeshError, match=words):
        wc.shell(wc.Surface(x, tris), 0.01)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((wc.box(0.1, 1), 0.01), "surface .*: give a wc.Surface"),
        ((sheet(1), 0.0), "thickness 0.0: give a number above 0"),
        ((sheet(1), 0.01, "up"), "side 'up': give 'outside' or 'inside' or 'both'"),
    ],
)
def test_a_shell_of_nothing_is_refused(given, words):
    with pytest.raises(ValueError, match=words):
        wc.shell(*given)


def test_a_height_field_has_its_heights_above_its_grid(rng):
    heights = rng.uniform(-0.3, 0.3, (4, 6))
    mesh = wc.heightfield(heights, (3.0, 10.0), 0.05)
    assert mesh.volume == pytest.approx(3.0 * 10.0 * 0.05)
    top = mesh.vertices[24:].reshape(4, 6, 3)
    np.testing.assert_array_equal(top[..., 2], heights)
    np.testing.assert_allclose(top[:, 0, 0], [-1.5, -0.5, 0.5, 1.5])
    np.testing.assert_allclose(top[0, :, 1], [-5, -3, -1, 1, 3, 5])
    np.testing.assert_allclose(
        mesh.vertices[:24] - mesh.vertices[24:], np.tile([0, 0, -0.05], (24, 1))
    )
    np.testing.assert_allclose(np.ptp(wc.heightfield(heights, 2.0, 0.1).vertices, axis=0)[:2], 2.0)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((np.zeros(4), 1.0, 0.1), "heights .*: give numbers of shape"),
        ((np.zeros((1, 4)), 1.0, 0.1), "of two or more each"),
        ((np.full((2, 2), np.nan), 1.0, 0.1), "heights .* it is nan"),
        ((np.zeros((2, 2)), (1.0, 0.0), 0.1), "size .*: give a number above 0"),
        ((np.zeros((2, 2)), "wide", 0.1), "size 'wide'"),
        ((np.zeros((2, 2)), 1.0, -0.1), "thickness -0.1: give a number above 0"),
    ],
)
def test_what_is_no_height_field_is_refused(given, words):
    with pytest.raises(ValueError, match=words):
        wc.heightfield(*given)
