"""raycast.py, render.py and files.py: silhouettes, colours, shadows, files."""

import struct
import sys
import zlib

import numpy as np
import pytest
import warp as wp
from pxr import Usd, UsdGeom

from warp_contact.kernels.output.raycast import screen
from warp_contact.picture import files, render
from warp_contact.picture.raycast import Camera, Renderer
from warp_contact.usd.prims import linear

RED = np.array([0.6, 0.02, 0.02])


def sphere(n: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and outward triangles of a unit sphere by longitude and latitude."""
    lat, lon = np.meshgrid(np.pi * np.arange(1, n) / n, np.pi * np.arange(2 * n) / n, indexing="ij")
    x = np.stack([np.sin(lat) * np.cos(lon), np.sin(lat) * np.sin(lon), np.cos(lat)], -1)
    x = np.concatenate([x.reshape(-1, 3), [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
    m, tris = 2 * n, []
    for j in range(m):
        k = (j + 1) % m
        tris += [[len(x) - 2, j, k], [len(x) - 1, (n - 2) * m + k, (n - 2) * m + j]]
        for i in range(n - 2):
            a, b, c, d = i * m + j, i * m + k, (i + 1) * m + k, (i + 1) * m + j
            tris += [[a, d, c], [a, c, b]]
    return x.astype(np.float32), np.array(tris)


def is_red(picture: np.ndarray) -> np.ndarray:
    """Which pixels are clearly red."""
    c = picture.astype(int)
    return (c[..., 0] > c[..., 1] + 30) & (c[..., 0] > c[..., 2] + 30)


def stage_of(points, tris, color) -> Usd.Stage:
    """A stage with one mesh that rises by 0.5 m a frame for three frames."""
    stage = Usd.Stage.CreateInMemory()
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(2)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/World").GetPrim())
    mesh = UsdGeom.Mesh.Define(stage, "/World/ball")
    mesh.CreateFaceVertexCountsAttr(np.full(len(tris), 3))
    mesh.CreateFaceVertexIndicesAttr(tris.ravel())
    for frame in range(3):
        mesh.CreatePointsAttr().Set(points + np.float32([0.0, 0.0, 0.5 * frame]), frame)
    mesh.CreateDisplayColorPrimvar("constant").Set([tuple(map(float, color))])
    return stage


def test_a_triangle_covers_the_pixels_it_should():
    # From 10 m above, 40 pixels show 4 m: 0.1 m a pixel.
    points = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0]])
    fov = 2.0 * np.degrees(np.arctan(2.0 / 10.0))
    camera = Camera(np.array([0.0, 0.0, 10.0]), np.zeros(3), fov)
    renderer = Renderer([[0, 1, 2]], points, size=(40, 40), samples=1, rays=1)
    red = is_red(renderer.picture(points, np.tile(RED, (3, 1)), camera))
    x = -2.0 + 0.1 * (np.arange(40) + 0.5)
    y = -x[:, None]
    inside = (x > -1.0) & (y > -1.0) & (x + y < 0.0)
    near = abs(x + y) < 1e-6  # centres of pixels on the hypotenuse
    assert (red == inside)[~near].all()


def test_a_sphere_has_a_round_outline_and_one_bright_side():
    points, tris = sphere()
    camera = Camera(np.array([0.0, -40.0, 0.0]), np.zeros(3), 2.0 * np.degrees(np.arctan(2 / 40.0)))
    renderer = Renderer(tris, points, size=(100, 100), rays=2)
    picture = renderer.picture(points, np.tile(RED, (len(points), 1)), camera)
    red = is_red(picture)
    # The outline of a polyhedron with 48 sides has 0.3 % less area; half a pixel of edge is 2 %.
    assert red.sum() * 0.04**2 == pytest.approx(np.pi, rel=0.025)
    rows, columns = np.nonzero(red)
    assert rows.mean() == pytest.approx(49.5, abs=0.3)
    assert columns.mean() == pytest.approx(49.5, abs=0.3)
    # The sun stands on the left: SUN points toward -x.
    assert picture[40:60, 30:40, 0].mean() > picture[40:60, 60:70, 0].mean() + 10


def test_corner_normals_are_smooth_on_a_sphere_and_sharp_on_a_cube():
    points, tris = sphere()
    renderer = Renderer(tris, points)
    normals = corner_normals(renderer, points)
    # The mean of the facets around a vertex is within their spread of 7.5 degrees of the radius.
    assert (normals * points[tris.ravel()]).sum(1).min() > np.cos(np.radians(7.5))
    corner = np.array([[0.0, 0, 0], [1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2]])
    normals = corner_normals(Renderer(faces, corner), corner).reshape(3, 3, 3)
    for face, axis in enumerate([[0, 0, -1], [0, -1, 0], [-1, 0, 0]]):
        np.testing.assert_allclose(normals[face], np.tile(axis, (3, 1)), atol=1e-6)


def corner_normals(renderer: Renderer, points) -> np.ndarray:
    """The normals the renderer shades with, shape (3 n_tri, 3)."""
    x = wp.array(points, dtype=wp.vec3)
    return renderer.corner_normals(x).numpy()


def test_a_body_darkens_the_ground_below_it():
    points, tris = sphere()
    points = points + np.float32([0.0, 0.0, 1.3])
    camera = Camera(np.array([0.0, -12.0, 9.0]), np.zeros(3))
    ground = [(np.array([0.0, 0.0, 1.0]), 0.0)]
    colors = np.tile(RED, (len(points), 1))
    renderer = Renderer(tris, points, ground, size=(96, 72), samples=1, rays=4)
    picture = renderer.picture(points, colors, camera).astype(float).mean(-1)
    empty = renderer.picture(points + np.float32([0, 0, 100]), colors, camera, np.zeros(3), 4.0)
    change = empty.astype(float).mean(-1) - picture
    assert change[~is_red(empty)].max() > 40.0
    # From below the ground there is nothing but the body and the background.
    below = Camera(np.array([0.0, -12.0, -9.0]), np.array([0.0, 0.0, 1.0]))
    assert is_red(renderer.picture(points, colors, below)).any()


def test_a_plane_cuts_a_sphere_and_shows_its_inside():
    points, tris = sphere()
    fov = 2.0 * np.degrees(np.arctan(2 / 40.0))
    colors, blue = np.tile(RED, (len(points), 1)), np.tile([[0.02, 0.02, 0.6]], (len(points), 1))

    def view(cut, eye):
        renderer = Renderer(tris, points, size=(100, 100), samples=1, rays=2, cut=cut)
        camera = Camera(np.array([eye, 0.0, 0.0]), np.zeros(3), fov)
        picture = renderer.picture(points, colors, camera, inside=blue).astype(int)
        return is_red(picture), picture[..., 2] > picture[..., 0] + 60

    half = (2.0, 0.0, 0.0), 1.0  # x > 0.5 is cut off: a disc of radius 0.87
    outside, inside = view(half, 40.0)
    # 24 and 48 facets around leave 1 % of the area out, and half a pixel of edge is 2 %.
    assert inside.sum() * 0.04**2 == pytest.approx(0.75 * np.pi, rel=0.04)
    # Its middle is 39.5 m away, that of the ring around it 40 m.
    assert outside.sum() * 0.04**2 == pytest.approx(0.25 * np.pi, rel=0.1)
    behind, inside = view(half, -40.0)
    assert behind.sum() * 0.04**2 == pytest.approx(np.pi, rel=0.025) and not inside.any()
    assert not np.any(view(((1.0, 0.0, 0.0), -1.5), 40.0))
    whole, inside = view(((1.0, 0.0, 0.0), 1.5), 40.0)
    assert whole.sum() == behind.sum() and not inside.any()


def test_what_is_cut_off_throws_no_shadow():
    points, tris = sphere()
    points = points + np.float32([0.0, 0.0, 1.3])
    camera = Camera(np.array([0.0, -12.0, 9.0]), np.zeros(3))
    ground = [(np.array([0.0, 0.0, 1.0]), 0.0)]
    colors = np.tile(RED, (len(points), 1))
    far, place = points + np.float32([0.0, 0.0, 100.0]), (np.zeros(3), 4.0)
    settings = {"size": (48, 36), "samples": 1, "rays": 4}
    empty = Renderer(tris, points, ground, **settings).picture(far, colors, camera, *place)
    for n, d, whole in (((0.0, 0.0, 1.0), 0.2, False), ((0.0, 0.0, 1.0), 3.0, True)):
        renderer = Renderer(tris, points, ground, **settings, cut=(n, d))
        picture = renderer.picture(points, colors, camera, *place)
        assert (np.abs(picture.astype(int) - empty).max() > 40) == whole


@pytest.mark.parametrize("cut", [(0.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0, np.nan)])
def test_a_cut_that_is_no_plane_is_refused(cut, tmp_path):
    with pytest.raises(ValueError, match="cut"):
        render.render(stage_of(*sphere(4), RED), tmp_path, cut=cut)


def test_the_inside_of_a_mesh_has_the_colour_of_most_of_its_points():
    drawing = render.Drawing((), (3, 2), np.zeros((0, 3)), ())
    colors = np.array([[0.1] * 3, [0.1] * 3, [0.9] * 3, [0.5] * 3, [0.5] * 3])
    np.testing.assert_array_equal(drawing.middle(colors)[:, 0], [0.1, 0.1, 0.1, 0.5, 0.5])


def test_screen_is_the_inverse_of_linear():
    for code in ("000000", "0a141e", "4c86b8", "ffffff"):
        expected = np.frombuffer(bytes.fromhex(code), np.uint8) / 255.0
        values = [screen(float(c)) for c in linear(code)]
        np.testing.assert_allclose(values, expected, atol=1e-5)


def test_polygons_become_fans():
    tris = render.fans(np.array([3, 4, 5]), np.arange(12))
    expected = [[0, 1, 2], [3, 4, 5], [3, 5, 6], [7, 8, 9], [7, 9, 10], [7, 10, 11]]
    np.testing.assert_array_equal(tris, expected)


def test_the_automatic_camera_sees_the_whole_box():
    low, high = np.array([-1.0, -2.0, 0.0]), np.array([3.0, 0.5, 0.7])
    camera = render.fitting_camera(low, high, 16 / 9)
    right, up, forward = camera.axes()
    slope = np.tan(np.radians(camera.fov) / 2.0)
    for corner in np.stack(np.meshgrid(*zip(low, high, strict=True)), -1).reshape(-1, 3):
        d = corner - camera.eye
        assert abs(d @ up) < slope * (d @ forward)
        assert abs(d @ right) < slope * 16 / 9 * (d @ forward)


def test_pictures_of_a_stage_follow_its_frames(tmp_path):
    points, tris = sphere(8)
    stage = stage_of(points, tris, RED)
    paths = render.render(stage, tmp_path / "out", [0, 2], (64, 48), samples=1, rays=1)
    assert [path.name for path in paths] == ["000000.png", "000002.png"]
    heights = [np.nonzero(is_red(pixels(path)))[0].mean() for path in paths]
    assert heights[1] < heights[0] - 5
    with pytest.raises(ValueError, match="no frame 7: the file has 0 to 2"):
        render.render(stage, tmp_path, [7])


def pixels(path) -> np.ndarray:
    """A picture file as an array."""
    image = pytest.importorskip("PIL.Image")
    with image.open(path) as picture:
        return np.asarray(picture)


def test_png_needs_no_library(tmp_path, monkeypatch):
    picture = np.random.default_rng(3).integers(0, 256, (7, 5, 3)).astype(np.uint8)
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "PIL", None)
        files.write_png(tmp_path / "own.png", picture)
        with pytest.raises(ImportError, match="Pillow"):
            files.animate([tmp_path / "own.png"], tmp_path / "a.webp")
    np.testing.assert_array_equal(pixels(tmp_path / "own.png"), picture)
    data = (tmp_path / "own.png").read_bytes()
    assert struct.unpack(">II", data[16:24]) == (5, 7)
    (length,) = struct.unpack(">I", data[33:37])
    assert len(zlib.decompress(data[41 : 41 + length])) == 7 * (1 + 3 * 5)


def test_a_film_holds_every_picture_also_of_odd_size(tmp_path, monkeypatch):
    for k in range(3):
        files.write_png(tmp_path / f"{k}.png", np.full((9, 15, 3), 80 * k, np.uint8))
    pictures = sorted(tmp_path.glob("*.png"))
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "imageio_ffmpeg", None)
        with pytest.raises(ImportError, match=r"pip install 'warp_contact\[video\]'"):
            files.animate(pictures, tmp_path / "all.mp4")
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    files.animate(pictures, tmp_path / "all.mp4", 25.0)
    assert ffmpeg.count_frames_and_secs(str(tmp_path / "all.mp4"))[0] == 3
    with pytest.raises(OSError, match=r"cannot write .*all\.mp4: ffmpeg says "):
        files.animate(pictures, tmp_path / "absent" / "all.mp4")


@pytest.mark.parametrize("kind", ["webp", "gif"])
def test_animations_hold_every_picture(tmp_path, kind):
    image = pytest.importorskip("PIL.Image")
    for k in range(3):
        files.write_png(tmp_path / f"{k}.png", np.full((8, 8, 3), 80 * k, np.uint8))
    files.animate(sorted(tmp_path.glob("*.png")), tmp_path / f"all.{kind}", 25.0)
    with image.open(tmp_path / f"all.{kind}") as animation:
        assert animation.n_frames == 3
