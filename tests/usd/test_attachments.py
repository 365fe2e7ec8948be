"""Attachments in USD: joints and attachments that others know, read back with the same bits."""

import re
import shutil

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdPhysics

import warp_contact as wc
from warp_contact.scene.scene import rotation_matrix
from warp_contact.usd.check import problems
from warp_contact.usd.reader import open_stage

SOLID, SOFT = wc.Rigid(1000.0), wc.NeoHookean(2e5, 0.3, 1000.0, 2e-3)
DIE = wc.box(0.125, 2)  # float32 holds it exactly, as all places of this file
RIGHT, TOP = DIE.vertices[:, 0] < -0.06, DIE.vertices[:, 2] > 0.06
TURN = (0.1, 0.2, 0.3, 0.9)


def own_scene() -> wc.Scene:
    """All kinds: hard and by springs, of rigid and soft bodies, at each other and at the world."""
    scene, places = wc.Scene(friction=0.5), {}
    for label, material, x, z in (
        ("post", SOLID, 0.0, 1.0),
        ("arm", SOLID, 0.25, 1.0),
        ("pad", SOFT, 0.375, 1.0),
        ("bob", SOLID, 0.375, 0.75),
        ("sled", SOLID, 1.0, 1.0),
        ("rider", SOLID, 1.0, 1.25),
        ("upper", SOFT, 2.0, 1.0),
        ("lower", SOFT, 2.0, 0.875),
        ("weak", SOLID, 3.0, 1.0),
    ):
        places[label] = x, 0.0, z
        scene.add_body(DIE, material, places[label], fixed=label == "post", label=label)
    scene.attach("arm", "post", "hinge", at=(0.0625, 0.0, 1.0), axis=(0.0, 1.0, 0.0), label="elbow")
    scene.attach("pad", "arm", "weld", vertices=RIGHT, label="glue")
    scene.attach("bob", "pad", "ball", at=(0.375, 0.0, 0.9375), label="pin")
    axis = {"axis": (1.0, 0.0, 1.0), "breaking_force": 100.0}
    scene.attach("sled", None, "slider", at=places["sled"], **axis, label="rail")
    scene.attach("rider", "sled", "weld", stiffness=1e4, label="saddle")
    scene.attach("upper", None, "weld", vertices=TOP, stiffness=5e2, label="ceiling")
    scene.attach("lower", "upper", "weld", vertices=TOP, breaking_force=90.0, label="two halves")
    scene.attach("weak", None, "ball", vertices=[3], breaking_force=3.0, label="thread")
    return scene


def written(place, scene: wc.Scene, frames: int, **options) -> wc.Simulation:
    sim = wc.Simulation(scene)
    with wc.UsdWriter(place, sim, **options) as usd:
        for _ in sim.frames(frames):
            usd.write()
    assert problems(place) == []
    return sim


def test_what_is_attached_comes_back_and_moves_to_the_same_bits(tmp_path):
    sim = written(tmp_path / "run", own_scene(), 8)
    found = wc.Scene.from_usd(tmp_path / "run")
    assert found.not_read == []
    for one, other in zip(found.attachments, sim.scene.attachments, strict=True):
        for name in ("label", "kind", "stiffness", "breaking_force"):
            assert getattr(one, name) == getattr(other, name)
        assert one.a.label == other.a.label
        assert (one.b and one.b.label) == (other.b and other.b.label)
    again = wc.Simulation(found)
    for _ in again.frames(8):
        pass
    np.testing.assert_array_equal(again.positions(), sim.positions())
    for attachment in found.attachments:
        force, wanted = (s.attachment_force(attachment.label) for s in (again, sim))
        np.testing.assert_array_equal(force, wanted)
    assert not again.is_attached("thread")


def test_a_turned_scene_comes_back_to_the_rounding_of_float32(tmp_path):
    scene, middle = wc.Scene((0.0, 0.0, -5.0)), np.array([0.3, 0.0, 1.0])
    line = rotation_matrix(TURN) @ (0.0, 0.0, 1.0)
    rail = scene.add_body(DIE, SOLID, middle, TURN, label="rail")
    bead = scene.add_body(DIE, SOLID, middle + 0.2 * line, TURN, label="bead")
    pad = scene.add_body(DIE, SOFT, middle + 0.325 * line, TURN, label="pad")
    scene.attach(bead, rail, "slider", at=middle + 0.2 * line, axis=line)
    scene.attach(rail, None, "hinge", at=middle, axis=(1.0, 2.0, 0.0), stiffness=900.0)
    scene.attach(pad, bead, "weld", vertices=DIE.vertices[:, 2] < -0.06)
    sim = written(tmp_path / "run", scene, 6)
    again = wc.Simulation(wc.Scene.from_usd(tmp_path / "run"))
    for _ in again.frames(6):
        pass
    np.testing.assert_allclose(again.positions(), sim.positions(), atol=2e-6)  # of 1.5 m
    assert np.abs(sim.positions(pad) - pad.x).max() > 0.01


def test_others_find_both_frames_of_a_joint_in_the_same_place(tmp_path):
    scene = wc.Scene()
    rail = scene.add_body(DIE, SOLID, (1.0, 0.2, 0.3), TURN, label="rail")
    bead = scene.add_body(DIE, SOLID, (1.2, 0.2, 0.3), (0.5, -0.1, 0.2, 0.7), label="bead")
    line = np.array([1.0, 2.0, -2.0]) / 3.0
    scene.attach(bead, rail, "slider", at=(1.1, 0.2, 0.3), axis=line, breaking_force=7.0)
    scene.attach(rail, None, "hinge", at=(1.0, 0.2, 0.4), axis=line)
    written(tmp_path / "run", scene, 1)
    stage = open_stage(tmp_path / "run")
    joints = [UsdPhysics.Joint(p) for p in stage.Traverse() if p.IsA(UsdPhysics.Joint)]
    kinds = [str(j.GetPrim().GetTypeName()) for j in joints]
    assert kinds == ["PhysicsPrismaticJoint", "PhysicsRevoluteJoint"]
    places = (1.1, 0.2, 0.3), (1.0, 0.2, 0.4)
    for joint, at, force in zip(joints, places, (7.0, np.inf), strict=True):
        assert joint.GetBreakForceAttr().Get() == force
        for k in "01":
            targets = getattr(joint, f"GetBody{k}Rel")().GetTargets()
            frame = Gf.Matrix4d(1.0)
            if targets:
                prim = UsdGeom.Xformable(stage.GetPrimAtPath(targets[0]))
                frame = prim.ComputeLocalToWorldTransform(Usd.TimeCode.Default())  # the start
            place = frame.Transform(Gf.Vec3d(getattr(joint, f"GetLocalPos{k}Attr")().Get()))
            turn = Gf.Rotation(Gf.Quatd(getattr(joint, f"GetLocalRot{k}Attr")().Get()))
            axis = frame.TransformDir(turn.TransformDir(Gf.Vec3d.XAxis()))
            np.testing.assert_allclose(place, at, atol=2e-7)  # float32
            np.testing.assert_allclose(axis, line, atol=2e-7)


def test_what_broke_stays_broken_and_the_rest_goes_on_from_the_last_frame(tmp_path):
    scene = own_scene()
    whole = {"velocities": True, "animate_tets": True}
    sim = written(tmp_path / "run", scene, 8, **whole)
    sim.detach("pin")
    with wc.UsdWriter(tmp_path / "run", sim, resume=True, **whole) as usd:
        sim.step_frame()
        usd.write()
    assert problems(tmp_path / "run") == []
    found = wc.Scene.from_usd(tmp_path / "run", at="last")
    assert found.not_read == []
    labels = [attachment.label for attachment in found.attachments]
    assert labels == ["elbow", "glue", "rail", "saddle", "ceiling", "two halves"]
    again = wc.Simulation(found)
    np.testing.assert_allclose(again.positions(), sim.positions(), atol=3e-7)  # float32
    for _ in range(4):
        sim.step_frame(), again.step_frame()
    for label in "arm", "sled", "bob", "weak":
        # The arm carries a soft pad, which the weld does not bend in the first step.
        atol = 5e-5 if label == "arm" else 2e-6
        np.testing.assert_allclose(again.positions(label), sim.positions(label), atol=atol)
    assert len(wc.Scene.from_usd(tmp_path / "run").attachments) == 8
    early = wc.Scene.from_usd(tmp_path / "run", at=8)
    assert "pin" in [attachment.label for attachment in early.attachments]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run of one frame, on the device that Warp prefers."""
    place = tmp_path_factory.mktemp("attachments") / "run"
    written(place, own_scene(), 1)
    return place


@pytest.mark.parametrize(
    ("path", "name", "value", "reason"),
    [
        ("pin", "physics:coords0", [(np.nan, 0, 0)], "coords .*: give finite numbers"),
        ("pin", "physics:indices0", [40], "tets \\[40\\]: body 'pad' has 40"),
        ("glue", "physics:indices0", [*range(8), 27], "it names vertex 27"),
        ("glue", "physics:coords1", [(0, 0, 0)] * 8, "does not say where its vertices are held"),
        ("ceiling", "physics:coords1", [(0, np.inf, 0)] * 9, "points .*: give finite numbers"),
        ("rail", "userProperties:axis", (np.nan, 0, 0), "axis .*: give finite numbers"),
        ("elbow", "userProperties:points1", [(1e30, 0, 0)] * 2, "points .*: give .* numbers"),
        ("saddle", "userProperties:stiffness", -1.0, "stiffness -1.0: give a number above 0"),
    ],
)
def test_what_is_damaged_of_an_attachment_is_listed_and_the_rest_is_read(
    path, name, value, reason, run, tmp_path
):
    shutil.copytree(run, tmp_path / "run")
    stage = Usd.Stage.Open(str(tmp_path / "run" / "topology.usdc"))
    stage.GetPrimAtPath(f"/World/attachments/{path}").GetAttribute(name).Set(value)
    stage.Save()
    with pytest.warns(UserWarning, match="not read or assumed"):
        scene = wc.Scene.from_usd(tmp_path / "run")
    (line,) = scene.not_read
    assert f"/World/attachments/{path}" in line and re.search(reason, line)
    assert len(scene.attachments) == 7
