"""Rigid bodies in USD: their prims move, their points are written once."""

import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics

import warp_contact as wc
from warp_contact.command import cli
from warp_contact.picture.render import Drawing
from warp_contact.scene.scene import rotation_matrix
from warp_contact.usd import reader
from warp_contact.usd.check import problems

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from command_line import complaint

FRAMES = 6
SCENE = """
import numpy as np
import warp_contact as wc

def build(high: float = 0.2, rigid: bool = True):
    scene = wc.Scene(friction=0.5)
    scene.add_plane((0.0, 0.0, 1.0))
    mesh = wc.box((0.1, 0.06, 0.03), 3).transformed(np.eye(3), (0.4, 0.2, -0.3))
    stiff = wc.Rigid(1000.0) if rigid else wc.NeoHookean(1e7, 0.3, 1000.0)
    turned, spin = (0.1, 0.2, 0.3, 0.9), (3.0, 25.0, 1.0)
    scene.add_body(mesh, stiff, (0.0, 0.0, 0.3 + high), turned, angular_velocity=spin, label="die")
    scene.add_body(wc.box(0.1, 2), stiff, (1.0, 0.0, 0.05), fixed=True, label="tool")
    scene.add_body(wc.box(0.1, 2), wc.NeoHookean(1e5, 0.3, 1000.0), (1.0, 0.0, 0.15), label="soft")
    return scene
"""


def scene_file(folder: Path) -> str:
    """The file of a scene with a rigid body that spins, one that is fixed, and a soft one."""
    path = folder / "scene.py"
    path.write_text(SCENE)
    return str(path)


def run(place: Path, rigid: bool = True, **options) -> np.ndarray:
    """Positions at each frame of a run that is written; the fixed body is lifted and turned."""
    names: dict = {}
    exec(SCENE, names)
    sim = wc.Simulation(names["build"](rigid=rigid), integrator="implicit")
    own, rest, found = sim._bodies.range("tool"), wc.box(0.1, 2).vertices, []
    with wc.UsdWriter(place, sim, overwrite=True, **options) as usd:
        for frame in range(1, FRAMES + 1):
            turn = rotation_matrix((0.0, 0.0, np.sin(0.1 * frame), np.cos(0.1 * frame)))
            target = rest @ turn.T + [1.0, 0.0, 0.05 - 0.01 * frame]
            sim.set_velocity("tool", (target - sim.positions("tool")) * sim.fps)
            sim.step_frame()
            usd.write()
            found.append(sim.positions())
    np.testing.assert_allclose(found[-1][own], target, atol=1e-6)
    return np.array(found)


def test_world_points_are_the_positions_and_local_points_those_of_the_mesh(tmp_path):
    x = run(tmp_path / "run", flatten=True, velocities=True, animate_tets=True)
    for path in tmp_path / "run", tmp_path / "run" / "run.usdc":
        assert problems(path) == []
        stage, first = reader.open_stage(path), 0
        drawing = Drawing.of(stage)
        for body, rigid in zip(reader.read_bodies(stage), (True, True, False), strict=True):
            rest = np.asarray(body.sim.GetPointsAttr().Get(), dtype=float)
            own = slice(first, first := first + len(rest))
            assert body.rigid == rigid
            for mesh in body.mesh, body.sim:
                names = [a.GetName() for a in mesh.GetPrim().GetAttributes() if a.GetTimeSamples()]
                assert ("points" in names) != rigid and ("extent" in names) != rigid
                assert ("velocities" in names) == (not rigid)
            for frame in range(1, FRAMES + 1):
                cache = UsdGeom.XformCache(frame)
                matrix = np.array(cache.GetLocalToWorldTransform(body.sim.GetPrim()))
                points = np.asarray(body.sim.GetPointsAttr().Get(frame), dtype=float)
                world = points @ matrix[:3, :3] + matrix[3, :3]
                # Float32 rounding of coordinates up to 1 m; a driven body is rounded every step.
                off = 1e-6 if body.fixed else 1.2e-7
                np.testing.assert_allclose(world, x[frame - 1][own], rtol=0.0, atol=off)
            ids = np.unique(body.sim.GetSurfaceFaceVertexIndicesAttr().Get())
            surface = reader.read_points(stage, FRAMES)[body.label]
            np.testing.assert_allclose(surface, x[-1][own][ids], rtol=0.0, atol=off)
        drawn = drawing.points(FRAMES)
        wanted = reader.read_points(stage, FRAMES).values()
        np.testing.assert_array_equal(drawn, np.concatenate(list(wanted)))
    die = reader.read_bodies(stage)[0].sim.GetPointsAttr().Get()
    mesh = wc.box((0.1, 0.06, 0.03), 3).transformed(np.eye(3), (0.4, 0.2, -0.3))
    np.testing.assert_array_equal(die, mesh.vertices.astype(np.float32))


def test_what_a_rigid_body_weighs_is_written(tmp_path):
    run(tmp_path / "run")
    stage = reader.open_stage(tmp_path / "run")
    prim = stage.GetPrimAtPath("/World/die")
    mass, mesh = UsdPhysics.MassAPI(prim), wc.box((0.1, 0.06, 0.03), 3)
    solid = wc.Rigid(1000.0).solid(mesh.vertices + [0.4, 0.2, -0.3], mesh.tets)
    turn = np.array(Gf.Matrix3d(Gf.Quatd(mass.GetPrincipalAxesAttr().Get())))
    moments = np.diag(mass.GetDiagonalInertiaAttr().Get())
    # Float32.
    assert mass.GetMassAttr().Get() == pytest.approx(solid.mass, rel=1e-6)
    np.testing.assert_allclose(mass.GetCenterOfMassAttr().Get(), solid.centre, rtol=1e-6)
    np.testing.assert_allclose(turn.T @ moments @ turn, solid.inertia, atol=1e-9)
    assert UsdPhysics.RigidBodyAPI(prim).GetKinematicEnabledAttr().Get() is False


def test_a_rigid_body_takes_less_room_than_a_soft_one(tmp_path):
    def size(place) -> int:
        return sum(path.stat().st_size for path in (place / "frames").iterdir())

    run(tmp_path / "rigid")
    run(tmp_path / "soft", rigid=False)
    saved = size(tmp_path / "soft") - size(tmp_path / "rigid")
    # Of 56 and 26 surface vertices there are no points; colours and contact remain.
    assert saved > 0.7 * FRAMES * (56 + 26) * 12


def test_a_tet_mesh_is_read_back_where_the_body_began(tmp_path):
    x = run(tmp_path / "run")
    mesh = wc.TetMesh.load(tmp_path / "run" / "run.usda", prim="/World/die/sim")
    np.testing.assert_allclose(mesh.vertices, x[0][: len(mesh.vertices)], atol=1.2e-7)


def test_a_run_is_resumed_where_its_bodies_were(tmp_path, capsys):
    scene, out, whole = scene_file(tmp_path), str(tmp_path / "run"), str(tmp_path / "whole")
    common = ["run", scene, "--quiet", "--frames"]
    assert cli.main([*common, "3", "--out", out]) == 0
    assert cli.main([*common, "6", "--out", out, "--resume"]) == 0
    assert cli.main([*common, "6", "--out", whole]) == 0
    for place in out, whole:
        assert cli.main(["validate", place]) == 0
        assert cli.main(["info", place]) == 0
    said = capsys.readouterr().out
    assert said.count("fixed  rigid") == 2
    stages = reader.open_stage(out), reader.open_stage(whole)
    for frame in range(7):
        found, wanted = (reader.read_points(stage, frame) for stage in stages)
        for label in wanted:
            np.testing.assert_array_equal(found[label], wanted[label])
    other = [*common, "8", "--out", out, "--resume", "--set", "high=0.25"]
    assert cli.main(other) == 2
    assert "placed or moved otherwise" in complaint(capsys)


def lost_sample(place):
    place["xformOp:orient"].ClearAtTime(3)


def not_finite(place):
    place["xformOp:translate"].Set((0.0, np.nan, 0.0), 2)


def still(place):
    place["xformOp:translate"].Clear()
    place["xformOp:translate"].Set((0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lost_sample, "orient has 5 samples"),
        (not_finite, "turned and moved alone at frame 2"),
        (still, "translate has no samples"),
    ],
)
def test_the_check_sees_a_wrong_transform(tmp_path, damage, words):
    run(tmp_path / "run")
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.TransferContent(reader.open_stage(tmp_path / "run").Flatten())
    stage = Usd.Stage.Open(layer)
    assert problems(stage) == []
    prim = stage.GetPrimAtPath("/World/die")
    damage({name: prim.GetAttribute(name) for name in prim.GetPropertyNames()})
    found = problems(stage)
    assert any(line.startswith("/World/die: ") and words in line for line in found), found


def test_a_rigid_body_that_is_driven_out_of_its_shape_is_named(tmp_path):
    scene = wc.Scene()
    scene.add_body(wc.box(0.1, 2), wc.Rigid(1000.0), fixed=True, label="tool")
    sim = wc.Simulation(scene)
    with wc.UsdWriter(tmp_path / "run", sim) as usd:
        sim.step_frame()
        usd.write()
        sim.set_velocity("tool", 2.0 * sim.positions("tool"))
        sim.step_frame()
        with pytest.raises(ValueError, match=r"'tool' is rigid, but .* at frame 2"):
            usd.write()
    assert reader.open_stage(tmp_path / "run").GetEndTimeCode() == 1
    assert problems(tmp_path / "run") == []
