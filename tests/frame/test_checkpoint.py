"""checkpoint.py: a run that goes on from a file is the run that was never interrupted."""

import numpy as np
import pytest

from warp_contact import (
    ContactSurface,
    Corotated,
    NeoHookean,
    Penalty,
    PredictedForce,
    Scene,
    Simulation,
    TetMesh,
    VirtualSurface,
    box,
    sphere,
)

RUBBER = NeoHookean(3e4, 0.3, 1000.0, 2e-3)
RESPONSES = ContactSurface(), ContactSurface("literal"), Penalty(500.0), PredictedForce()
RESPONSES += (VirtualSurface(500.0),)


def falling(rng, mass: float = 1.0) -> Scene:
    """Blocks and a ball that come to touch each other, a plane, and a lid that moves down."""
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    rubber = NeoHookean(3e4, 0.3, 1000.0 * mass, 2e-3)
    for k, mesh in enumerate((box(0.1, 2), sphere(0.05, 41), box(0.1, 1))):
        place = rng.uniform(-0.01, 0.01, 3) + [0.0, 0.0, 0.06 + 0.11 * k]
        scene.add_body(mesh, rubber, place, velocity=(0.0, 0.0, -1.0))
    scene.add_body(box(0.2, 1), RUBBER, (0.0, 0.0, 0.5), fixed=True, label="lid")
    return scene


@pytest.mark.parametrize("response", RESPONSES, ids=str)
def test_a_run_goes_on_from_its_checkpoint_with_the_same_bits(rng, tmp_path, response):
    scene = falling(rng)
    through = Simulation(scene, response)
    through.set_velocity(3, (0.0, 0.0, -1.0))
    for _ in through.frames(8):
        if through.frame == 5:
            through.save(tmp_path / "run.npz")
    later = Simulation(scene, response)
    for _ in later.frames(2):  # whatever it did before
        pass
    later.load(tmp_path / "run.npz")
    assert later.frame == 5 and later.time == 5 / 60 and later.measure().forces == {}
    for _ in later.frames(3):
        pass
    np.testing.assert_array_equal(through.positions(), later.positions())
    np.testing.assert_array_equal(through.velocities(), later.velocities())
    assert through.substeps == later.substeps
    a, b = through.measure(), later.measure()
    assert a.forces == b.forces and a.forces and a.energy == b.energy
    assert [p.name for p in tmp_path.iterdir()] == ["run.npz"]


def test_a_checkpoint_before_the_first_frame_starts_the_run(rng, tmp_path):
    scene = falling(rng)
    first, second = Simulation(scene), Simulation(scene)
    first.save(tmp_path / "start")
    second.step_frame()
    second.load(tmp_path / "start")
    for sim in (first, second):
        sim.step_frame()
    np.testing.assert_array_equal(first.positions(), second.positions())


def test_a_checkpoint_of_something_else_is_refused(rng, tmp_path):
    state = rng.bit_generator.state
    sim = Simulation(falling(rng))
    sim.save(tmp_path / "run.npz")
    rng.bit_generator.state = state
    others = {
        "of another scene": Simulation(falling(rng, mass=2.0)),
        "of other settings: response=ContactSurface": Simulation(sim.scene, PredictedForce()),
        "of other settings: fps=60.0, not 30.0": Simulation(sim.scene, fps=30),
        "of other settings: substeps=None, not 40": Simulation(sim.scene, substeps=40),
        "integrator=explicit, not implicit": Simulation(sim.scene, integrator="implicit"),
    }
    for words, other in others.items():
        with pytest.raises(ValueError, match=words):
            other.load(tmp_path / "run.npz")
        assert other.frame == 0
    (tmp_path / "text").write_text("nothing")
    np.save(tmp_path / "array.npy", np.zeros(3))
    with pytest.raises(ValueError, match=r"array\.npy is no checkpoint"):
        sim.load(tmp_path / "array.npy")
    with pytest.raises(ValueError, match="text is no checkpoint"):
        sim.load(tmp_path / "text")
    with pytest.raises(FileNotFoundError):
        sim.load(tmp_path / "missing")


def one(mesh=None, fixed=None, world=0, plane=(0.0, 0.0, 1.0), offset=-1.0, material=RUBBER, **of):
    """A block above a plane, and what may be different about it."""
    scene = Scene(**of)
    scene.add_plane(plane, offset)
    scene.add_body(mesh or box(0.1, 2), material, fixed=fixed)
    scene.add_body(box(0.1, 1), RUBBER, (1.0, 0.0, 0.0), world=world)
    return Simulation(scene)


PRESSED = TetMesh(box(0.1, 2).vertices * [1.25, 0.8, 1.0], box(0.1, 2).tets)  # of the same masses


@pytest.mark.parametrize(
    "other",
    [
        {"gravity": (0.0, 0.0, -9.8)},
        {"friction": 0.31},
        {"plane": (0.0, 0.1, 1.0)},
        {"offset": -1.1},
        {"fixed": [0]},
        {"world": 1},
        {"mesh": PRESSED},
        {"material": NeoHookean(3e4, 0.31, 1000.0, 2e-3)},
        {"material": NeoHookean(3e4, 0.3, 1001.0, 2e-3)},
        {"material": NeoHookean(3e4, 0.3, 1000.0, 3e-3)},
        {"material": Corotated(3e4, 0.3, 1000.0, 2e-3)},
    ],
    ids=str,
)
def test_a_checkpoint_of_a_scene_that_differs_in_one_thing_is_refused(tmp_path, other):
    one().save(tmp_path / "run.npz")
    one().load(tmp_path / "run.npz")
    with pytest.raises(ValueError, match="of another scene"):
        one(**other).load(tmp_path / "run.npz")


def test_a_checkpoint_that_cannot_be_finished_leaves_the_one_before(tmp_path, monkeypatch):
    sim, path = one(), tmp_path / "run.npz"
    sim.save(path)
    before = path.read_bytes()
    sim.step_frame()

    def full(file, **arrays) -> None:
        file.write(b"half of it")
        raise OSError("no space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(np, "savez", full)
        with pytest.raises(OSError, match="no space left"):
            sim.save(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
    other = one()
    other.load(path)
    assert other.frame == 0
