"""usd/contacts.py: points and arrows of contact forces; what Blender makes of the files."""

import importlib.util
import json
import subprocess
import sys

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom

import warp_contact as wc
from warp_contact.usd import reader
from warp_contact.usd.check import problems

RUBBER = wc.NeoHookean(1e5, 0.3, 1000.0)


def falling(gravity=(0.0, 0.0, -9.81), **options) -> wc.Simulation:
    """A block that reaches one that is held in its second frame, and another one far away."""
    scene = wc.Scene(gravity)
    scene.add_body(wc.box(0.1, 2), RUBBER, (0.0, 0.0, 0.05), fixed=True, label="my base")
    scene.add_body(
        wc.box(0.1, 2), RUBBER, (0.01, 0.0, 0.16), velocity=(0, 0, -0.3), label="contacts"
    )
    scene.add_body(wc.box(0.2, 2), RUBBER, (9.0, 0.0, 0.0), fixed=True, label="held")
    return wc.Simulation(scene, **options)


def write(place, sim: wc.Simulation, frames: int = 3, contacts=True, **options) -> list:
    """Contacts after each frame of a run that is written."""
    with wc.UsdWriter(place, sim, contacts=contacts, **options) as usd:
        found = []
        for _ in sim.frames(frames):
            usd.write()
            found.append((sim.contacts(), usd.arrows.scale))
    return found


def force_of(made: wc.Contacts) -> np.ndarray:
    """Force [N] of each contact on its first body, shape (n, 3)."""
    return made.normal_force[:, None] * made.normal + made.friction_force


def test_points_and_arrows_are_the_contacts_of_the_last_step(tmp_path):
    found = write(tmp_path / "run", falling(), flatten=True)
    assert len(found[0][0]) == 0 < len(found[-1][0])
    for path in tmp_path / "run", tmp_path / "run" / "run.usdc":
        assert problems(path) == []
        stage = reader.open_stage(path)
        points = UsdGeom.Points.Get(stage, "/World/contacts")
        arrows = UsdGeom.BasisCurves.Get(stage, "/World/forces")
        primvars = UsdGeom.PrimvarsAPI(points)
        for frame, (made, scale) in enumerate(found, start=1):
            n = len(made)
            force = force_of(made)
            at = np.array(points.GetPointsAttr().Get(frame)).reshape(n, 3)
            line = np.array(arrows.GetPointsAttr().Get(frame)).reshape(n, 2, 3)
            assert list(arrows.GetCurveVertexCountsAttr().Get(frame)) == [2] * n
            names = ("force", "body", "partner")
            values = (primvars.GetPrimvar(f"contact:{name}").Get(frame) for name in names)
            for given, wanted in zip(values, (force, *made.bodies.T), strict=True):
                np.testing.assert_allclose(np.array(given).reshape(wanted.shape), wanted, rtol=1e-6)
            # Float32.
            np.testing.assert_allclose(at, made.point, atol=1e-7)
            np.testing.assert_allclose(line[:, 0], at, atol=1e-7)
            np.testing.assert_allclose(line[:, 1] - line[:, 0], scale * force, atol=1e-6)
    assert wc.Scene.from_usd(tmp_path / "run").not_read == []


def test_without_them_nothing_is_written(tmp_path):
    sim = falling()
    with wc.UsdWriter(tmp_path / "run", sim) as usd:
        sim.step_frame()
        usd.write()
    assert not reader.open_stage(tmp_path / "run").GetPrimAtPath("/World/contacts")


def test_a_body_s_weight_has_its_size_unless_a_length_is_given(tmp_path):
    weight = 0.1**3 * 1000.0 * 9.81
    assert write(tmp_path / "a", falling(), 1)[0][1] == pytest.approx(0.1 / weight, rel=1e-6)
    assert write(tmp_path / "b", falling(), 1, contacts=0.25)[0][1] == 0.25
    found = write(tmp_path / "c", falling((0.0, 0.0, 0.0)))
    largest = [np.linalg.norm(force_of(made), axis=1).max(initial=0.0) for made, _ in found]
    first = np.flatnonzero(largest)[0]
    wanted = [0.0] * first + [pytest.approx(0.1 / largest[first])] * (len(found) - first)
    assert [scale for _, scale in found] == wanted


def test_a_run_with_contacts_is_resumed_and_keeps_the_length_of_its_arrows(tmp_path):
    sim = falling((0.0, 0.0, 0.0))
    scale = write(tmp_path / "run", sim)[-1][1]
    sim.save(tmp_path / "now.npz")
    again = falling((0.0, 0.0, 0.0))
    again.load(tmp_path / "now.npz")
    assert write(tmp_path / "run", again, 2, resume=True)[-1][1] == scale
    assert problems(tmp_path / "run") == []
    assert reader.open_stage(tmp_path / "run").GetEndTimeCode() == 5


@pytest.mark.parametrize("contacts", [-1.0, 0, "yes", None, np.nan])
def test_a_length_that_is_none_is_refused(tmp_path, contacts):
    with pytest.raises(ValueError, match=r"contacts, which may be True or False too, .*: give a n"):
        wc.UsdWriter(tmp_path / "run", falling(), contacts=contacts)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("/World/forces.curveVertexCounts", [2], "forces: curves do not fit its"),
        ("/World/contacts.points", [(np.nan, 0, 0)], "contacts: points are not finite"),
        ("/World/contacts.primvars:contact:force", [(0, 0, 1)], "contact:force has 1 values"),
        ("/World/contacts.extent", [(0, 0, 0), (9, 9, 9)], "contacts: extent is not that"),
    ],
)
def test_the_check_sees_contacts_that_do_not_fit(tmp_path, path, value, words):
    write(tmp_path / "run", falling())
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.TransferContent(reader.open_stage(tmp_path / "run").Flatten())
    stage = Usd.Stage.Open(layer)
    assert problems(stage) == []
    stage.GetPropertyAtPath(path).Set(value, 3)
    assert any(words in line and line.endswith("at frame 3") for line in problems(stage))


BLENDER = """
import bpy, json, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.usd_import(filepath=sys.argv[1])
bpy.context.scene.frame_set(3)
graph = bpy.context.evaluated_depsgraph_get()
found = {}
for thing in bpy.data.objects:
    if thing.data:
        names = thing.evaluated_get(graph).data.attributes
        found[thing.name] = {a.name: len(a.data) for a in names}
print("found", json.dumps(found))
"""


@pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="Blender is not installed")
def test_blender_shows_bodies_by_their_names_and_contacts(tmp_path):
    n = len(write(tmp_path / "run", falling())[-1][0])
    command = [sys.executable, "-c", BLENDER, str(tmp_path / "run" / "run.usda")]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found = json.loads(said.partition("found ")[2])
    assert {*found} == {"my_base", "contacts_1", "held", "contacts", "forces"}
    assert found["my_base"]["displayColor"] == found["my_base"]["contact:pressure"] == 26
    assert (found["contacts"]["position"], found["forces"]["position"]) == (n, 2 * n)
