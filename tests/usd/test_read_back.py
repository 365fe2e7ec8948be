"""What a UsdWriter writes is read back by Scene.from_usd, and goes on."""

import numpy as np
import pytest

import warp_contact as wc
from warp_contact.usd.check import problems

MESH = wc.box((0.1, 0.12, 0.08), 2)
TURN = (0.1, 0.2, 0.3, 0.9)
WHOLE = {"velocities": True, "animate_tets": True}


def own_scene() -> wc.Scene:
    """One of all that a file has to hold."""
    scene = wc.Scene((0.5, 0.0, -9.81), friction=0.4)
    scene.add_plane((0.0, 0.1, 1.0), -0.2, friction=0.9)
    held, spin = MESH.vertices[:, 2] > 0.03, {"velocity": (1, 2, 3), "angular_velocity": (1, 5, 0)}
    moved = MESH.transformed(np.eye(3), (0.3, 0.2, 0.1))
    given = wc.Rigid(mass=2.0, centre=(0.01, 0, 0), inertia=0.02 * np.eye(3) + 0.001)
    foam = wc.Corotated(1.3e5, 0.37, 1100.0, damping=1.5e-3)
    springs = wc.SpringNetwork(1.0, 2.0, 3.0, 900.0, 1e-3)
    scene.add_body(MESH, foam, (0, 0, 0.3), TURN, fixed=held, label="a ball", friction=0.7, world=2)
    scene.add_body(MESH, wc.NeoHookean(1e5, 0.3, 1000.0), (0, 0, 0.1), **spin, label="b")
    scene.add_body(MESH, springs, (0, 1, 0.1), label="net")
    scene.add_body(moved, wc.Rigid(1300.0), (1, 0, 0.1), TURN, **spin, label="die")
    scene.add_body(MESH, given, (2, 0, 0.1), TURN, label="given")
    scene.add_body(MESH, wc.Rigid(1000.0), (3, 0, 0.1), TURN, fixed=True, label="tool")
    return scene


def written(place, scene: wc.Scene, frames: int = 4, **options) -> wc.Simulation:
    """A run of a scene that is in USD files."""
    sim = wc.Simulation(scene)
    with wc.UsdWriter(place, sim, **options) as usd:
        for _ in sim.frames(frames):
            usd.write()
    assert problems(place) == []
    return sim


@pytest.mark.parametrize("options", [{}, WHOLE], ids=["surfaces", "whole"])
def test_what_is_written_is_read_back(options, tmp_path):
    scene = own_scene()
    written(tmp_path / "run", scene, 1, **options)
    found = wc.Scene.from_usd(tmp_path / "run")
    assert found.not_read == []
    assert (found.gravity, found.friction, found.plane_friction) == (scene.gravity, 0.4, [0.9])
    # Float32, as all that follows.
    for (n, h), (m, k) in zip(found.planes, scene.planes, strict=True):
        np.testing.assert_allclose([*n, h], [*m, k], rtol=1e-6)
    for body, wanted in zip(found.bodies, scene.bodies, strict=True):
        assert (body.label, body.world) == (wanted.label, wanted.world)
        assert body.friction == (0.4 if wanted.friction is None else wanted.friction)
        np.testing.assert_array_equal(body.mesh.tets, wanted.mesh.tets)
        np.testing.assert_array_equal(body.fixed, wanted.fixed)
        np.testing.assert_allclose(body.x, wanted.x, atol=2e-7)
        np.testing.assert_allclose(body.v, wanted.v, atol=2e-6)
        if wanted.label == "given":
            assert (body.material.mass, body.material.centre) == (2.0, (0.01, 0.0, 0.0))
            np.testing.assert_allclose(body.material.inertia, wanted.material.inertia, atol=1e-8)
        else:
            assert body.material == wanted.material


def test_a_run_goes_on_from_its_last_frame(tmp_path):
    sim = written(tmp_path / "run", own_scene(), **WHOLE)
    with pytest.raises(ValueError, match="has frames 1 to 4, not 5"):
        wc.Scene.from_usd(tmp_path / "run", at=5)
    scene = wc.Scene.from_usd(tmp_path / "run", at="last")
    assert scene.not_read == []
    again = wc.Simulation(scene)
    np.testing.assert_allclose(again.positions(), sim.positions(), atol=3e-7)  # float32
    np.testing.assert_allclose(again.velocities(), sim.velocities(), atol=3e-6)
    for _ in range(2):
        sim.step_frame(), again.step_frame()
    # 2 mm of deformation at 5 m/s; what rounding has changed grows in free flight.
    np.testing.assert_allclose(again.positions(), sim.positions(), atol=2e-6)


def test_a_deformed_start_is_written_and_read_back(tmp_path):
    written(tmp_path / "run", own_scene(), **WHOLE)
    late = wc.Scene.from_usd(tmp_path / "run", at=3)
    assert late.bodies[1].start is not None and late.bodies[3].start is None
    written(tmp_path / "late", late, 1)
    found = wc.Scene.from_usd(tmp_path / "late")
    for body, wanted in zip(found.bodies, late.bodies, strict=True):
        np.testing.assert_allclose(body.starts, wanted.starts, atol=2e-7)
        np.testing.assert_allclose(body.x, wanted.x, atol=2e-7)
        np.testing.assert_allclose(body.v, wanted.v, atol=2e-6)


def test_frames_without_inner_vertices_are_refused_and_motion_that_is_lost_is_listed(tmp_path):
    scene = wc.Scene()
    scene.add_body(MESH, wc.NeoHookean(1e5, 0.3, 1000.0), label="a")
    tool = scene.add_body(MESH, wc.Rigid(1000.0), (1, 0, 0), fixed=True, label="tool")
    sim = wc.Simulation(scene)
    sim.set_velocity(tool, (0.0, 0.0, 1.0))
    for place, options in ("bare", {}), ("slow", {"animate_tets": True}):
        with wc.UsdWriter(tmp_path / place, sim, **options) as usd:
            for _ in sim.frames(2):
                usd.write()
    with pytest.raises(
        ValueError, match=r"/World/a has no frames of its inner .*animate_tets=True"
    ):
        wc.Scene.from_usd(tmp_path / "bare", at="last")
    with pytest.warns(UserWarning, match="not_read"):
        found = wc.Scene.from_usd(tmp_path / "slow", at="last")
    lines = ["no velocities of /World/a at 4: it is at rest"]
    assert found.not_read == [*lines, "the motion of /World/tool, which is driven: it stands still"]


def test_restitution_is_read_back(tmp_path):
    scene = wc.Scene(restitution=0.3)
    scene.add_plane((0.0, 0.0, 1.0), restitution=0.6)
    scene.add_body(MESH, wc.Rigid(1000.0), (0, 0, 0.1), restitution=0.8)
    scene.add_body(MESH, wc.Rigid(1000.0), (1, 0, 0.1))
    scene.add_body(MESH, wc.Rigid(1000.0), (2, 0, 0.1), restitution=0.0)
    written(tmp_path / "run", scene, 1)
    found = wc.Scene.from_usd(tmp_path / "run")
    assert found.not_read == []
    assert found.restitution == 0.3
    assert found.coefficients("restitution") == [0.8, 0.3, 0.0, 0.6]
