"""A run that is interrupted and taken up again from its checkpoint."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from command_line import blocks, complaint
from disk import Full

from warp_contact import files
from warp_contact.command import cli, run
from warp_contact.simulation import Simulation
from warp_contact.usd import reader
from warp_contact.usd.check import problems

THROWN = '''"""A block that is thrown at another one, which a weak penalty lets through."""

import warp_contact as wc

PENALTY = {"stiffness": 1e-3, "damping": 0.0}


def build(speed: float = 8.0):
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    block = wc.box(0.5, 1)
    stuff = wc.NeoHookean(1e5, 0.3, 1000.0)
    scene.add_body(block, stuff, label="target", fixed=True)
    scene.add_body(block, stuff, position=(0.1, 0.1, 0.6), velocity=(0.0, 0.0, -speed))
    return scene
'''

RESTING = """
import warp_contact as wc


def build(high):
    rubber = wc.NeoHookean(3e4, 0.3, 1000.0, 1e-2)
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    scene.add_body(wc.box(0.1, 2), rubber, (0.0, 0.0, 0.0502))
    far, up = (0.0, 3.3) if high < 1.0 else (5.0, 0.0)
    scene.add_body(wc.box(0.1, 2), rubber, (far, 0.0, high), velocity=(0.0, 0.0, up))
    return scene
"""


@pytest.fixture
def thrown(tmp_path):
    """The file of a scene in which something happens in every frame."""
    path = tmp_path / "thrown.py"
    path.write_text(THROWN)
    return str(path)


@pytest.fixture
def scene(tmp_path):
    """The file of a small scene."""
    return blocks(tmp_path)


def interrupted(monkeypatch, method: str, frame: int, command: list[str]) -> None:
    """Run a command that is interrupted as it calls a method of the simulation after a frame."""
    whole = getattr(Simulation, method)

    def stopped(self, *args):
        if self.frame == frame:
            raise KeyboardInterrupt
        whole(self, *args)

    with monkeypatch.context() as patch:
        patch.setattr(Simulation, method, stopped)
        assert cli.main(command) == 130


def contents(out) -> tuple[str, str]:
    """All that is in the stage of a run, and its metrics."""
    stage = reader.open_stage(out).Flatten(addSourceFileComment=False)
    return stage.ExportToString(), (out / "metrics.jsonl").read_text()


@pytest.mark.parametrize("response", ["contact-surface", "penalty"])
@pytest.mark.parametrize(
    ("method", "every", "kept"), [("step_frame", 0.0, 4), ("save", 0.0, 3), ("step_frame", 1e9, 0)]
)
def test_a_resumed_run_is_the_run_that_was_never_interrupted(
    tmp_path, thrown, response, method, every, kept, monkeypatch, capsys
):
    monkeypatch.setattr(run, "SAVE_EVERY", every)
    command = ["run", thrown, "--frames", "8", "--response", response, "--out"]
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert cli.main([*command, str(whole)]) == 0
    interrupted(monkeypatch, method, 4, [*command, str(out)])
    with np.load(out / "checkpoint.npz") as checkpoint:
        assert checkpoint["frame"] == kept
    assert reader.open_stage(out).GetEndTimeCode() == 4
    capsys.readouterr()
    assert cli.main([*command, str(out), "--resume"]) == 0
    assert "out.usda: frames 0 to 8" in capsys.readouterr().out
    assert contents(out) == contents(whole)
    assert problems(out) == []
    # What went into the target before the interrupt came out at its other side after it.
    passed = [json.loads(line)["tunnelled"] for line in contents(out)[1].splitlines()]
    assert passed[4] == 0
    assert (passed[8] > 0) == (response == "penalty")


@pytest.mark.parametrize("high", [0.6, 20.0])
def test_a_run_in_which_bodies_sleep_is_resumed_like_any_other(tmp_path, monkeypatch, high, capsys):
    """One block lies still and sleeps, the other falls onto it, or far away."""
    path = tmp_path / "resting.py"
    path.write_text(RESTING)
    monkeypatch.setattr(run, "SAVE_EVERY", 0.0)
    command = ["run", str(path), "--sleep", "--frames", "50", "--set", f"high={high}", "--out"]
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert cli.main([*command, str(whole)]) == 0
    interrupted(monkeypatch, "step_frame", 42, [*command, str(out)])
    assert "interrupted; --resume goes on from frame 42 or" in capsys.readouterr().err
    with np.load(out / "checkpoint.npz") as checkpoint:
        assert checkpoint["sleeping.awake"].tolist() == [0, 1]
    assert cli.main([*command, str(out), "--resume"]) == 0
    assert contents(out) == contents(whole)
    capsys.readouterr()
    assert cli.main([*command[:2], *command[3:], str(out), "--resume"]) == 2
    assert "of other settings" in complaint(capsys)


def test_a_finished_run_is_continued_or_left_as_it_is(tmp_path, thrown):
    command = ["run", thrown, "--quiet", "--out"]
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert cli.main([*command, str(whole), "--frames", "4"]) == 0
    assert cli.main([*command, str(out), "--frames", "2"]) == 0
    for frames in "4", "4", "3":
        assert cli.main([*command, str(out), "--frames", frames, "--resume"]) == 0
        assert contents(out) == contents(whole)


def test_a_run_over_another_one_leaves_it_until_its_own_first_frame_is_whole(
    tmp_path, thrown, monkeypatch, capsys
):
    out = tmp_path / "out"
    command = ["run", thrown, "--frames", "1", "--quiet", "--out", str(out)]
    assert cli.main([*command, "--frames", "2"]) == 0
    before = contents(out)
    assert cli.main(command) == 2
    assert "out.usda is there already" in complaint(capsys)
    interrupted(monkeypatch, "save", 0, [*command, "--overwrite"])
    assert cli.main([*command, "--overwrite", "--substeps", "1", "--set", "speed=1e5"]) != 0
    assert contents(out) == before
    assert cli.main([*command, "--overwrite", "--set", "speed=7.0"]) == 0
    assert contents(out) != before and problems(out) == []
    assert len(contents(out)[1].splitlines()) == 2
    with np.load(out / "checkpoint.npz") as checkpoint:
        assert checkpoint["frame"] == 1


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (["thrown"], "of another scene"),
        (["scene", "--fps", "30"], "of other settings: fps=60"),
        (["scene", "--integrator", "implicit"], "integrator=explicit, not implicit"),
        (["scene", "--set", "gap=0.02"], "placed or moved otherwise"),
        (["scene", "--set", "name=top"], "other bodies"),
    ],
)
def test_another_scene_does_not_resume(tmp_path, scene, thrown, other, words, capsys):
    out = tmp_path / "out"
    assert cli.main(["run", scene, "--frames", "1", "--quiet", "--out", str(out)]) == 0
    before = contents(out)
    files = {"scene": scene, "thrown": thrown}
    command = ["run", *(files.get(word, word) for word in other), "--out", str(out), "--resume"]
    assert cli.main(command) == 2
    assert words in complaint(capsys)
    assert contents(out) == before


def test_another_start_velocity_does_not_resume(tmp_path, thrown, capsys):
    out = tmp_path / "out"
    command = ["run", thrown, "--frames", "2", "--out", str(out)]
    assert cli.main([*command, "--quiet"]) == 0
    assert cli.main([*command, "--resume", "--set", "speed=9.0"]) == 2
    assert "placed or moved otherwise" in complaint(capsys)


def test_frames_are_on_the_disk_before_a_checkpoint_that_counts_on_them(
    tmp_path, thrown, monkeypatch
):
    monkeypatch.setattr(run, "SAVE_EVERY", 0.0)
    on_disk, saved, save, sync = set(), [], Simulation.save, files.sync

    def watched_sync(path):
        sync(path)
        on_disk.add(path.name)

    def watched_save(sim, path):
        # The first is published, with all that is beside it, before another one.
        wanted = {f"f.{frame:06d}.usdc" for frame in range(sim.frame + 1)} | {run.METRICS}
        saved.append(sim.frame == 0 or wanted <= on_disk)
        save(sim, path)

    monkeypatch.setattr(files, "sync", watched_sync)
    monkeypatch.setattr(Simulation, "save", watched_save)
    command = ["run", thrown, "--frames", "3", "--quiet", "--out", str(tmp_path / "out")]
    assert cli.main(command) == 0 and saved == 4 * [True]


@pytest.mark.parametrize("k", [*range(1, 60, 6), 1000])
def test_a_run_that_finds_the_disk_full_goes_on_when_there_is_room(
    tmp_path, thrown, k, monkeypatch
):
    """At several of its calls, from the first files to the last checkpoint."""
    monkeypatch.setattr(run, "SAVE_EVERY", 0.0)
    command = ["run", thrown, "--frames", "3", "--quiet", "--out"]
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert cli.main([*command, str(whole)]) == 0
    with monkeypatch.context() as patch:
        Full(patch, k)
        assert (cli.main([*command, str(out)]) == 0) == (k == 1000)
    # While the first files are moved to their place there may be none to be seen, but all to go on.
    assert not (out / "out.usda").exists() or problems(out) == []
    assert cli.main([*command, str(out), *(["--resume"] if out.exists() else [])]) == 0
    assert contents(out) == contents(whole)
    assert [path.name for path in out.rglob(".*")] == []
