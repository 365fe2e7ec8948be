"""usd/skin.py: render surfaces with uv, normals and materials beside the hidden tets."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdShade

import warp_contact as wc
from warp_contact.usd.check import problems
from warp_contact.usd.reader import open_stage

SOFT = wc.NeoHookean(1e5, 0.3, 1000.0, 1e-3)
BALL, FINE = wc.sphere(0.05, 41), wc.sphere(0.05, 147)


@pytest.fixture
def picture(tmp_path):
    """A picture, red on the left and blue on the right."""
    image = pytest.importorskip("PIL.Image")
    pixels = np.zeros((8, 8, 3), dtype=np.uint8)
    pixels[:, :4, 0], pixels[:, 4:, 2] = 255, 255
    image.fromarray(pixels).save(tmp_path / "skin.png")
    return tmp_path / "skin.png"


def scene_with(picture=None) -> wc.Scene:
    """A soft and a rigid ball with render surfaces that fall, and a soft one without."""
    used, tris = np.unique(FINE.surface, return_inverse=True)
    x, tris = FINE.vertices[used], tris.reshape(-1, 3)
    uv = np.where(x[tris][:, :, :2].mean(axis=1, keepdims=True) < 0.0, 0.25, 0.75)
    surface = wc.Surface(x, tris, np.tile(uv, (1, 3, 1)), x[tris], texture=picture)
    plain = wc.Surface(x, tris, colors=np.clip(x + 0.5, 0.0, 1.0))
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(BALL, SOFT, (0.0, 0.0, 0.06), render=surface, label="soft")
    scene.add_body(BALL, wc.Rigid(1e3), (0.2, 0.0, 0.06), (1, 0, 0, 1), render=plain, label="hard")
    scene.add_body(BALL, SOFT, (0.4, 0.0, 0.06), label="bare")
    return scene


def written(path, picture=None, frames: int = 3, **options) -> tuple[wc.Simulation, Usd.Stage]:
    sim = wc.Simulation(scene_with(picture))
    with wc.UsdWriter(path, sim, **options) as usd:
        for _ in sim.frames(frames):
            usd.write()
    return sim, open_stage(path)


def mesh_at(stage, path: str) -> UsdGeom.Mesh:
    return UsdGeom.Mesh(stage.GetPrimAtPath(path))


def test_render_surfaces_are_what_is_seen(tmp_path, picture):
    sim, stage = written(tmp_path / "run", picture)
    assert problems(tmp_path / "run") == []
    seen = {
        str(prim.GetPath())
        for prim in stage.Traverse()
        if prim.IsA(UsdGeom.Mesh) and UsdGeom.Imageable(prim).ComputePurpose() == "default"
    }
    assert seen == {
        f"/World/{name}" for name in ("soft/soft_render", "hard/hard_render", "bare/bare", "ground")
    }
    x, normals = sim.rendered("soft")
    soft = mesh_at(stage, "/World/soft/soft_render")
    np.testing.assert_array_equal(soft.GetPointsAttr().Get(3), x)
    np.testing.assert_array_equal(np.array(soft.GetNormalsAttr().Get(3)), normals.reshape(-1, 3))
    assert soft.GetNormalsInterpolation() == "faceVarying"
    assert len(soft.GetPointsAttr().GetTimeSamples()) == 3


def test_a_rigid_body_has_its_render_surface_written_once(tmp_path):
    sim, stage = written(tmp_path / "run")
    hard = mesh_at(stage, "/World/hard/hard_render")
    assert hard.GetPointsAttr().GetTimeSamples() == []
    place = np.array(hard.ComputeLocalToWorldTransform(3))
    points = np.array(hard.GetPointsAttr().Get()) @ place[:3, :3] + place[3, :3]
    np.testing.assert_allclose(points, sim.rendered("hard")[0], atol=1e-6)
    colors = hard.GetDisplayColorPrimvar()
    assert colors.GetInterpolation() == "vertex" and len(colors.Get()) == len(points)


def test_a_texture_is_copied_and_bound(tmp_path, picture):
    _, stage = written(tmp_path / "run", picture)
    assert (tmp_path / "run/texture_0.png").read_bytes() == picture.read_bytes()
    soft = mesh_at(stage, "/World/soft/soft_render")
    material = UsdShade.MaterialBindingAPI(soft.GetPrim()).ComputeBoundMaterial()[0]
    assert material.ComputeSurfaceSource()[0].GetIdAttr().Get() == "UsdPreviewSurface"
    st = UsdGeom.PrimvarsAPI(soft).GetPrimvar("st")
    assert st.GetInterpolation() == "faceVarying"
    found = wc.Surface.load(tmp_path / "run/run.usda", prim="/World/soft/soft_render")
    surface = scene_with(picture).bodies[0].render
    np.testing.assert_allclose(found.uv, surface.uv)
    np.testing.assert_allclose(found.normals, surface.normals, atol=1e-2)  # after three frames
    assert found.texture == tmp_path / "run/texture_0.png"


def test_a_run_with_a_texture_goes_on_and_is_replaced(tmp_path, picture):
    sim, _ = written(tmp_path / "run", picture)
    with wc.UsdWriter(tmp_path / "run", sim, resume=True) as usd:
        sim.step_frame()
        usd.write()
    assert (
        len(
            mesh_at(open_stage(tmp_path / "run"), "/World/soft/soft_render")
            .GetPointsAttr()
            .GetTimeSamples()
        )
        == 4
    )
    _, stage = written(tmp_path / "run", picture, overwrite=True, frames=2)
    assert problems(tmp_path / "run") == [] and stage.GetEndTimeCode() == 2


def test_a_texture_that_is_gone_ends_the_writer_before_anything_is_replaced(tmp_path, picture):
    written(tmp_path / "run", picture)
    sim = wc.Simulation(scene_with(picture))
    picture.unlink()
    with pytest.raises(OSError, match=r"skin\.png"):
        wc.UsdWriter(tmp_path / "run", sim, overwrite=True)
    assert open_stage(tmp_path / "run").GetEndTimeCode() == 3


def test_the_ray_caster_takes_the_colours_of_a_texture(tmp_path, picture):
    from warp_contact.picture.render import Drawing

    sim, stage = written(tmp_path / "run", picture)
    drawing = Drawing.of(stage)
    assert str(drawing.meshes[0].GetPath()) == "/World/soft/soft_render"
    colors = drawing.colors(3)[: drawing.sizes[0]]
    x = sim.scene.bodies[0].render.vertices
    left, right = x[:, 0] < -0.02, x[:, 0] > 0.02
    np.testing.assert_allclose(colors[left], np.tile([1.0, 0.0, 0.0], (left.sum(), 1)), atol=1e-6)
    np.testing.assert_allclose(colors[right], np.tile([0.0, 0.0, 1.0], (right.sum(), 1)), atol=1e-6)


def test_a_surface_without_a_picture_is_drawn_in_its_own_colours(tmp_path):
    from warp_contact.picture.render import Drawing

    sim, stage = written(tmp_path / "run")
    drawing = Drawing.of(stage)
    n = drawing.sizes[0]
    plain = sim.scene.bodies[1].render
    found = drawing.colors(3)[n : n + len(plain.vertices)]
    np.testing.assert_allclose(found, plain.colors, atol=1e-6)
