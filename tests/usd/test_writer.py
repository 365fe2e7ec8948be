"""warp_contact/usd/writer.py and usd/prims.py: what is written, and how it reads back."""

import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdShade

from warp_contact.scene.scene import rotation_matrix
from warp_contact.usd import fields, reader
from warp_contact.usd.check import problems
from warp_contact.usd.writer import UsdWriter

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fake_simulation import FakeSimulation, surface_ids, written


def test_every_frame_reads_back_at_its_time(tmp_path):
    stage = written(tmp_path / "two", 7)
    sim = FakeSimulation()
    assert list(reader.frame_numbers(stage)) == list(range(8))
    for frame in range(8):
        points = reader.read_points(stage, frame)
        for b, label in enumerate(sim.model.labels):
            np.testing.assert_array_equal(points[label], sim.at(frame)[surface_ids(sim, b)])


def test_nothing_is_wrong_with_what_is_written(tmp_path):
    sim = FakeSimulation(labels=("a", "b", "c"))
    written(tmp_path / "three", sim=sim, velocities=True, animate_tets=True, flatten=True)
    assert problems(tmp_path / "three") == []
    assert problems(tmp_path / "three" / "three.usdc") == []


def test_the_stage_appears_with_its_first_frame_and_is_valid_after_each(tmp_path):
    sim = FakeSimulation()
    writer = UsdWriter(tmp_path, sim)
    assert [p for p in tmp_path.iterdir() if not p.name.startswith(".")] == []
    for sim.frame in range(3):
        writer.write()
        stage = reader.open_stage(tmp_path)
        assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, sim.frame)
        assert problems(tmp_path) == []


def test_flattened_file_holds_the_same_frames(tmp_path):
    stage = written(tmp_path / "run", flatten=True)
    flat = Usd.Stage.Open(str(tmp_path / "run" / "run.usdc"))
    for frame in reader.frame_numbers(stage):
        expected = reader.read_points(stage, frame)
        for label, points in reader.read_points(flat, frame).items():
            np.testing.assert_array_equal(points, expected[label])


def test_layout_metadata_and_schemas(tmp_path):
    stage = written(tmp_path / "run", sim=FakeSimulation(fps=24))
    root = stage.GetRootLayer()
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert (root.timeCodesPerSecond, root.framesPerSecond, root.defaultPrim) == (24, 24, "World")
    body = stage.GetPrimAtPath("/World/left")
    assert "PhysicsDeformableBodyAPI" in body.GetMetadata("apiSchemas").GetAppliedItems()
    sim = UsdGeom.TetMesh.Get(stage, "/World/left/sim")
    assert sim.GetPurposeAttr().Get() == "guide"
    faces = UsdGeom.TetMesh.ComputeSurfaceFaces(sim, Usd.TimeCode.Default())
    own = sim.GetSurfaceFaceVertexIndicesAttr().Get()
    assert {tuple(sorted(f)) for f in faces} == {tuple(sorted(f)) for f in own}
    material, _ = UsdShade.MaterialBindingAPI(sim).ComputeBoundMaterial("physics")
    assert material.GetPrim().GetAttribute("physics:youngsModulus").Get() == pytest.approx(1e5)
    surface = stage.GetPrimAtPath("/World/left/left")
    look, _ = UsdShade.MaterialBindingAPI(surface).ComputeBoundMaterial()
    assert look.GetPath() == "/World/Looks/contact"
    ((n, h),) = reader.read_planes(stage)
    assert (*n, h) == (0.0, 0.0, 1.0, 0.0)


def test_a_plane_is_drawn_where_it_is(tmp_path, turned):
    sim = FakeSimulation()
    n, h = rotation_matrix(turned())[:, 2], 0.7
    sim.model.plane_n.assign(np.array([n]))
    sim.model.plane_h.assign(np.array([h]))
    stage = written(tmp_path / "run", 1, sim=sim)
    ground = UsdGeom.Mesh.Get(stage, "/World/ground")
    corners = np.array(ground.GetPointsAttr().Get())
    # Coordinates of some tens in float32.
    np.testing.assert_allclose(corners @ n, h, atol=1e-5)
    a, b, c, _ = corners
    assert np.cross(b - a, c - a) @ n > 0.0


def test_labels_become_valid_and_different_prims(tmp_path):
    labels = ("my apple", "my-apple", "1st", "Looks")
    stage = written(tmp_path / "names", 1, sim=FakeSimulation(labels, n=1))
    assert [body.label for body in reader.read_bodies(stage)] == list(labels)
    assert len({body.mesh.GetPath() for body in reader.read_bodies(stage)}) == 4
    assert problems(tmp_path / "names") == []


def test_contact_primvars_are_rounded_by_a_thousandth(tmp_path):
    sim = FakeSimulation(n=12)
    stage = written(tmp_path / "run", 5, sim=sim)
    ids = surface_ids(sim, 1)
    expected = sim.contact_fields()["pressure"][ids]
    prim = stage.GetPrimAtPath("/World/right/right")
    pressure = np.asarray(prim.GetAttribute("primvars:contact:pressure").Get(5))
    assert len(np.unique(fields.rounded(np.linspace(0.0, 7.0, 100_000)))) == fields.LEVELS
    # Half a step of LEVELS - 1 steps up to the largest value.
    np.testing.assert_allclose(pressure, expected, atol=0.51 * expected.max() / 999)
    color = np.asarray(UsdGeom.Gprim(prim).GetDisplayColorPrimvar().ComputeFlattened(5))
    assert color[expected.argmax(), 0] > color[expected.argmin(), 0]


def test_a_frame_costs_half_as_much_again_as_its_points(tmp_path, rng):
    sim = FakeSimulation(n=24)
    own = rng.random((2, len(sim.rest))).astype(np.float32)
    fields = {
        "pressure": own[0],
        "penetration": own[1],
        "partner": rng.integers(3, size=own[0].shape),
    }
    sim.contact_fields = lambda: fields
    written(tmp_path / "run", 3, sim=sim, tets=False)
    n = 2 * len(surface_ids(sim, 0))
    size = (tmp_path / "run" / "frames" / "f.000003.usdc").stat().st_size
    # Points take 12 bytes each, those in contact 1 for the colour, 1 for the partner, and packed
    # scalars 2.2 each: without packing they would take 8 bytes together, colours 12.
    assert size < 18 * n + 4096


def test_a_second_run_replaces_the_first_when_asked_to(tmp_path):
    written(tmp_path / "run", 6, flatten=True)
    with pytest.raises(FileExistsError, match=r"run\.usda is there already"):
        written(tmp_path / "run", 2)
    stage = written(tmp_path / "run", 2, overwrite=True)
    assert stage.GetEndTimeCode() == 2
    assert len(list((tmp_path / "run" / "frames").iterdir())) == 3
    assert not (tmp_path / "run" / "run.usdc").exists()
    assert problems(tmp_path / "run") == []


def test_frames_must_follow_each_other(tmp_path):
    sim = FakeSimulation(n=1)
    writer = UsdWriter(tmp_path / "run", sim)
    writer.write()
    sim.frame = 2
    with pytest.raises(ValueError, match="frame 2 cannot follow frame 0"):
        writer.write()


def test_root_path_is_a_directory_or_a_usda_file(tmp_path):
    assert reader.root_path(tmp_path / "a") == tmp_path / "a" / "a.usda"
    assert reader.root_path(tmp_path / "b.usda") == tmp_path / "b.usda"
    with pytest.raises(ValueError, match="directory"):
        reader.root_path(tmp_path / "c.usdc")
