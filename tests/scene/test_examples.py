"""scenes/examples: short, run as their first lines say, and right where there is a closed form."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from warp_contact import Simulation, scenes
from warp_contact.command import cli
from warp_contact.scenes.examples import (
    animated,
    conveyor,
    episodes,
    friction_sweep,
    gripper,
    material,
    repair,
    weight,
)

FOLDER = Path(__file__).resolve().parents[2] / "scenes" / "examples"
FILES = sorted(FOLDER.glob("[!_]*.py"))
SCENES = [path for path in FILES if "-> wc.Scene:" in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_an_example_has_less_than_60_lines_and_says_how_it_is_run(path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) < 60
    command = f"python -m warp_contact.scenes.examples.{path.stem}"
    if "__main__" not in text:
        command = f"warp-contact run scenes/examples/{path.name} "
    assert command in text.split('"""')[1]


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_a_scene_of_an_example_runs_from_the_command_line(path, tmp_path):
    out = tmp_path / "out"
    assert cli.main(["run", str(path), "--out", str(out), "--frames", "2", "--quiet"]) == 0
    lines = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    assert len(lines) == 3 and lines[-1]["inverted"] == 0


def test_examples_are_none_of_the_scenes_of_the_paper():
    assert "examples" not in scenes.names()


@pytest.mark.parametrize("tilt", [0.0, 20.0])
def test_the_plate_carries_the_weight_of_the_block(tilt):
    found, expected = weight.main(tilt)
    # After a second the block still swings: it carries its weight of 9.8 N but for that.
    np.testing.assert_allclose(found, expected, atol=5e-3)


def test_the_conveyor_takes_the_parcel_along_after_it_has_slipped():
    speeds = np.array(conveyor.main(frames=24))
    time = np.arange(1, 25) / 60.0
    slips = time < conveyor.SLIP - 1.0 / 60.0
    # The parcel swings within itself by a few per cent of the speed of the belt.
    expected = conveyor.FRICTION * 9.81 * time[slips]
    np.testing.assert_allclose(speeds[slips], expected, atol=0.03 * conveyor.SPEED)
    assert speeds[11] == pytest.approx(conveyor.SPEED, rel=0.03)
    assert abs(speeds[-1]) < 0.03 * conveyor.SPEED  # the belt stopped 12 frames ago


def test_the_block_goes_with_the_animated_skin_and_flies_off_with_its_speed():
    heights = np.array(animated.main())
    skin = animated.motion(animated.skin(), 60)[1:, :, 2].max(axis=1)
    flies = int(np.ceil(np.arccos(animated.COSINE) / animated.W * animated.FPS))
    # Pressed down by 27 m/s^2 it is lower by rho a EDGE / 2 E = 0.004 of its edge.
    np.testing.assert_allclose(heights[:flies], skin[:flies], atol=4e-3 * animated.EDGE)
    # The skin has a constant speed in a frame: the block may take off half a frame late or early.
    assert max(heights) == pytest.approx(animated.APEX, rel=0.02)
    assert max(heights) > skin.max() + 0.005


def test_in_newton_soft_bodies_tell_the_force_between_them():
    pytest.importorskip("newton", "1.8")
    from warp_contact.scenes.examples import in_newton

    force, weight = in_newton.main()
    # The lower block is pushed up by twice the weight and down by the upper one; they still swing.
    np.testing.assert_allclose(force, [[0.0, 0.0, weight]] * 2, atol=1e-3 * weight)


def test_the_gripper_lifts_the_box_by_friction_alone_and_lets_it_fall():
    phases = ((8, 0.006, 0.0), (12, 0.0, 0.05), (12, -0.02, 0.0))
    lifted = gripper.main(phases=phases)
    # Its own weight lets the box hang a little lower between the fingers.
    assert lifted[1] - lifted[0] == pytest.approx(0.05, abs=0.002)
    assert lifted[2] < lifted[1] - 0.04
    # Twice the friction of about 28 N carries less than the 2.1 N of the box.
    assert gripper.main(friction=0.02, phases=phases[:2])[1] < 0.035


def test_an_episode_gives_the_same_again_and_the_search_comes_near_the_mark():
    sim = Simulation(episodes.build(3))
    speeds = np.array([0.3, 0.4, 0.5])
    first = episodes.episode(sim, speeds)
    np.testing.assert_array_equal(episodes.episode(sim, speeds), first)
    best = episodes.main(episodes=3, worlds=6)
    assert best[-1] < 0.3 * best[0]


def test_the_bar_is_one_piece_after_its_repair_and_sags_as_a_whole():
    (bar,) = repair.build().bodies
    assert bar.mesh.n_pieces == 1 and len(bar.mesh.seams) == 0
    assert np.ptp(bar.mesh.vertices, axis=0) == pytest.approx([0.08, 0.02, 0.02])
    # In 5 frames the free half alone would have fallen by 34 mm.
    assert 1e-4 < repair.main(frames=5) < 0.025


def test_the_sweep_finds_which_blocks_slide_and_how_fast(tmp_path, monkeypatch):
    monkeypatch.setattr(friction_sweep, "FRICTIONS", (0.2, 0.4))
    monkeypatch.setattr(friction_sweep, "TILTS", (20.0,))
    here = SimpleNamespace(submit=submit)
    slides, rests = friction_sweep.main(out=tmp_path / "out", executor=here)
    assert slides == pytest.approx(friction_sweep.expected(0.2, 20.0), rel=0.01)
    assert abs(rests) < 1e-3 and friction_sweep.expected(0.4, 20.0) == 0.0
    assert len((tmp_path / "out" / "results.jsonl").read_text().splitlines()) == 2


def submit(call, *arguments):
    """Run a job at once, as an executor does later."""
    answer = call(*arguments)
    return SimpleNamespace(done=lambda: True, result=lambda: answer, cancel=lambda: False)


def test_the_material_of_the_example_bounces_without_gaining_energy():
    sim = Simulation(material.build())
    start = sim.measure().energy
    energies = [sim.measure().energy for _ in sim.frames(12)]
    assert max(energies) <= start * (1.0 + 1e-4)  # float32 positions
    assert sim.measure().volume_ratio > 0.5
