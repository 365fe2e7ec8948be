"""usd/check.py: every kind of damage to a file is seen."""

import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdShade

from warp_contact.usd.check import problems

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fake_simulation import written


def copied(stage) -> Usd.Stage:
    """A stage in memory with the same content, free to be damaged."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.TransferContent(stage.Flatten())
    return Usd.Stage.Open(layer)


def set_surface(stage, name, value, frame):
    stage.GetPrimAtPath("/World/left/left").GetAttribute(name).Set(value, frame)


def stale_extent(stage):
    set_surface(stage, "extent", [(0, 0, 0), (1, 1, 1)], 2)


def short_primvar(stage):
    set_surface(stage, "primvars:contact:pressure", [1.0, 2.0], 3)


def no_number(stage):
    mesh = UsdGeom.Mesh.Get(stage, "/World/left/left")
    points = np.array(mesh.GetPointsAttr().Get(1))
    points[3, 1] = np.nan
    mesh.GetPointsAttr().Set(points, 1)


def wrong_index(stage):
    set_surface(stage, "faceVertexIndices", [0, 1, 9999], Usd.TimeCode.Default())
    set_surface(stage, "faceVertexCounts", [3], Usd.TimeCode.Default())


def moving_topology(stage):
    mesh = UsdGeom.Mesh.Get(stage, "/World/left/left")
    mesh.GetFaceVertexCountsAttr().Set(mesh.GetFaceVertexCountsAttr().Get(), 1)


def inverted_tet(stage):
    attribute = UsdGeom.TetMesh.Get(stage, "/World/left/sim").GetTetVertexIndicesAttr()
    tets = np.array(attribute.Get())
    tets[5] = tets[5][[1, 0, 2, 3]]
    attribute.Set(tets)


def missing_sample(stage):
    stage.GetPrimAtPath("/World/left/left").GetAttribute("points").ClearAtTime(3)


def wrong_axis(stage):
    UsdGeom.SetStageUpAxis(stage, "Y")


def wrong_rate(stage):
    stage.SetFramesPerSecond(25)


def no_default_prim(stage):
    stage.ClearDefaultPrim()


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (stale_extent, "extent"),
        (short_primvar, "contact:pressure"),
        (no_number, "not finite"),
        (wrong_index, "left/left"),
        (moving_topology, "time-sampled"),
        (inverted_tet, "inverted"),
        (missing_sample, "samples"),
        (wrong_axis, "upAxis"),
        (wrong_rate, "framesPerSecond"),
        (no_default_prim, "defaultPrim"),
    ],
)
def test_the_check_sees(tmp_path, damage, message):
    stage = copied(written(tmp_path / "run"))
    assert problems(stage) == []
    damage(stage)
    found = problems(stage)
    assert any(message in line for line in found), found


@pytest.mark.skipif(Usd.GetVersion() < (0, 26, 3), reason="before that they lack what they load")
def test_the_validators_of_usd_are_asked(tmp_path):
    stage = copied(written(tmp_path / "run"))
    UsdShade.Shader.Get(stage, "/World/Looks/contact/surface").SetShaderId("NoSuchShader")
    assert any("NoSuchShader" in line for line in problems(stage))


def test_the_check_sees_a_lost_or_torn_frame(tmp_path):
    written(tmp_path / "run")
    frame = tmp_path / "run" / "frames" / "f.000002.usdc"
    whole = frame.read_bytes()
    frame.write_bytes(whole[: len(whole) // 2])
    assert problems(tmp_path / "run") != []
    frame.unlink()
    assert any("samples" in line for line in problems(tmp_path / "run"))


def test_the_check_sees_a_frame_in_the_place_of_another(tmp_path):
    written(tmp_path / "run")
    frames = tmp_path / "run" / "frames"
    (frames / "f.000003.usdc").write_bytes((frames / "f.000001.usdc").read_bytes())
    assert problems(tmp_path / "run") == ["f.000003.usdc is not frame 3: it has [1.0]"]


def test_the_check_reports_what_is_no_usd_file(tmp_path):
    (tmp_path / "x.usda").write_text("nothing")
    assert len(problems(tmp_path / "x.usda")) == 1
    assert len(problems(tmp_path / "absent")) == 1
