"""The command line and the progress line: what is printed, written and returned."""

import io
import json
import os
import subprocess
import sys
from dataclasses import dataclass, fields
from importlib.metadata import entry_points
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from command_line import blocks, complaint

from warp_contact import Measure
from warp_contact.command import cli, commands, metrics, run
from warp_contact.errors import SimulationError, UsageError
from warp_contact.progress import Progress, announce, clock
from warp_contact.scene.shapes import box
from warp_contact.simulation import Simulation
from warp_contact.usd import reader
from warp_contact.usd.check import problems


@pytest.fixture
def scene(tmp_path):
    """The file of a small scene."""
    return blocks(tmp_path)


def test_run_writes_every_frame_and_its_metrics(tmp_path, scene, capsys):
    out = tmp_path / "out"
    assert cli.main(["run", scene, "--out", str(out), "--set", "gap=0.05", "name=top"]) == 0
    assert "out.usda: frames 0 to 3" in capsys.readouterr().out
    assert problems(out) == []
    stage = reader.open_stage(out)
    assert list(reader.frame_numbers(stage)) == [0, 1, 2, 3]
    assert [body.label for body in reader.read_bodies(stage)] == ["lower", "top"]
    assert reader.read_view(stage)[0] == pytest.approx([1.0, -3.0, 1.5])
    lines = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    assert [line["frame"] for line in lines] == [0, 1, 2, 3]
    assert [line["time"] for line in lines] == pytest.approx([0.0, 1 / 60, 2 / 60, 3 / 60])
    figures = {name for name in dir(Measure) if not name.startswith("_")}
    figures |= {field.name for field in fields(Measure)}
    assert set(lines[3]) == {"frame", "time"} | figures
    energies = [lines[3][name] for name in ("kinetic", "elastic", "gravitational")]
    assert lines[3]["energy"] == sum(energies)
    # Free fall over a few steps of 1/60 s: the block only gains speed.
    assert lines[3]["kinetic"] > lines[2]["kinetic"] > lines[0]["kinetic"] == 0.0


@pytest.mark.parametrize("response", run.RESPONSES)
def test_run_takes_every_response_and_its_options(tmp_path, scene, response, capsys):
    out = tmp_path / "out"
    command = ["run", scene, "--out", str(out), "--response", response, "--frames", "2", "--quiet"]
    assert cli.main([*command, "--substeps", "40", "--fps", "100", "--flatten"]) == 0
    assert capsys.readouterr().out == ""
    stage = reader.open_stage(out / "out.usdc")
    assert (stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()) == (2, 100)


def test_a_run_that_fails_keeps_what_it_wrote(tmp_path, scene, capsys, monkeypatch):
    whole = Simulation.step_frame

    def step_frame(self):
        if self.frame == 2:
            raise SimulationError("frame 3: body 'upper' is no longer finite")
        whole(self)

    monkeypatch.setattr(Simulation, "step_frame", step_frame)
    out = tmp_path / "out"
    assert cli.main(["run", scene, "--out", str(out)]) == 1
    assert "frame 3: body 'upper'" in complaint(capsys)
    assert problems(out) == []
    assert reader.open_stage(out).GetEndTimeCode() == 2
    assert len((out / "metrics.jsonl").read_text().splitlines()) == 3


def test_an_interrupt_is_130(tmp_path, scene, capsys, monkeypatch):
    def step_frame(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(Simulation, "step_frame", step_frame)
    assert cli.main(["run", scene, "--out", str(tmp_path / "out")]) == 130
    assert "interrupted" in complaint(capsys)
    assert problems(tmp_path / "out") == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "COMMAND"),
        (["walk"], "walk"),
        (["run", "no_scene", "--out", "x"], "no scene 'no_scene'; there are bowl, "),
        (["run", "no_file.py", "--out", "x"], "no such file: no_file.py"),
        (["run", "SCENE"], "--out"),
        (["run", "SCENE", "--out", "x", "--frames", "0"], "--frames"),
        (["run", "SCENE", "--out", "x", "--fps", "nan"], "--fps"),
        (["run", "SCENE", "--out", "x", "--response", "glue"], "glue"),
        (["run", "SCENE", "--out", "x", "--set", "gap"], "KEY=VALUE"),
        (["run", "SCENE", "--out", "x", "--set", "cap=1"], "it has: gap, name"),
        (["run", "SCENE", "--out", "x", "--set", "name=lower"], "another body has this label"),
        (["run", "SCENE", "--out", "x", "--set", "gap='a'"], "TypeError"),
        (["run", "SCENE", "--out", "x", "--device", "cuda:77"], "unknown device 'cuda:77'"),
        (["run", "SCENE", "--out", "x.usdc"], "x.usdc"),
        (["run", "SCENE", "--out", ""], "the path is empty"),
        (["render", "x", "--out", ""], "the path is empty"),
        (["run", "SCENE", "--out", "x/new\nline"], "control character"),
        (["run", "SCENE", "--out", "/dev/null/x"], "Not a directory"),
        (["run", "SCENE", "--out", "x", "--resume", "--overwrite"], "not allowed with"),
        (["run", "SCENE", "--out", "x", "--resume"], "nothing to resume"),
        (["info", "nothing.npz"], "no such file: nothing.npz"),
        (["render", "nothing"], "no such file: nothing"),
        (["render", "nothing", "--size", "960"], "960"),
        (["validate", "nothing"], "no such file: nothing"),
    ],
)
def test_wrong_usage_is_one_line_and_2(arguments, words, tmp_path, scene, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main([scene if word == "SCENE" else word for word in arguments]) == 2
    assert words in complaint(capsys)
    assert not (tmp_path / "x").exists()


def test_a_broken_scene_file_is_reported_with_its_reason(tmp_path, capsys):
    for text, words in (("1 / 0", "ZeroDivisionError"), ("FRAMES = 2", "no function build()")):
        (tmp_path / "bad.py").write_text(text)
        assert cli.main(["run", str(tmp_path / "bad.py"), "--out", str(tmp_path / "x")]) == 2
        assert words in complaint(capsys)


def test_debug_raises_what_went_wrong(tmp_path):
    with pytest.raises(UsageError):
        cli.main(["--debug", "info", str(tmp_path / "nothing")])


def test_scenes_are_listed_with_their_first_line(capsys):
    assert cli.main(["scenes"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("bowl ") and line.endswith(".") for line in lines)


def test_info_render_and_validate_read_a_run(tmp_path, scene, capsys):
    out = str(tmp_path / "out")
    assert cli.main(["run", scene, "--out", out, "--frames", "1", "--quiet"]) == 0
    assert cli.main(["info", out]) == 0
    text = capsys.readouterr().out
    assert "frames  0 to 1, 60 a second" in text
    assert "bodies  2: 16 vertices" in text
    assert "fixed" in text
    assert cli.main(["render", out, "--size", "32x18", "--samples", "1", "--webp"]) == 0
    named = capsys.readouterr().out.splitlines()
    assert [os.path.basename(path) for path in named] == ["000000.png", "000001.png", "out.webp"]
    assert all(os.path.getsize(path) > 0 for path in named)
    cut = ["--cut", "0", "0", "0", "1"]
    assert cli.main(["render", out, "--size", "32x18", *cut]) == 1
    assert "cut [0.0, 0.0, 0.0, 1.0]: give a normal that is not zero" in complaint(capsys)
    assert cli.main(["render", out, "--frames", "5"]) == 2
    assert "no frame 5: the file has 0 to 1" in complaint(capsys)
    assert cli.main(["validate", out]) == 0
    assert capsys.readouterr().out == "ok: frames 0 to 1\n"
    (tmp_path / "out" / "frames" / "f.000001.usdc").unlink()
    assert cli.main(["validate", out]) == 1
    assert "samples" in capsys.readouterr().out


@pytest.mark.parametrize("suffix", [".npz", ".usda"])
def test_info_reads_a_mesh(tmp_path, suffix, capsys):
    box((1.0, 2.0, 3.0), (1, 2, 3)).save(tmp_path / f"mesh{suffix}")
    assert cli.main(["info", str(tmp_path / f"mesh{suffix}")]) == 0
    text = capsys.readouterr().out
    assert "24 vertices" in text
    assert "volume 6 m^3" in text


def test_settings_are_literals_or_strings():
    def build(a=0, b=0, c=0, d=0):
        pass

    values = run.settings(build, ["a=1e-3", "b=(1, 2)", "c=word", "d="])
    assert values == {"a": 1e-3, "b": (1, 2), "c": "word", "d": ""}
    assert run.settings(lambda **any_key: None, ["z=True"]) == {"z": True}


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        (None, list(range(11))),
        ("3", [3]),
        ("0,5,-1", [0, 5, 10]),
        ("0:11:5", [0, 5, 10]),
        ("8:", [8, 9, 10]),
        (":-9", [0, 1]),
        ("4:6,9", [4, 5, 9]),
    ],
)
def test_frames_are_numbers_and_slices(text, frames):
    assert commands.chosen_frames(text, range(11)) == frames


@pytest.mark.parametrize("text", ["11", "", "a", "1:2:3:4", "0:5:0", "5:2", "1,,2"])
def test_frames_that_are_not_there_are_refused(text):
    with pytest.raises(ValueError, match="frame"):
        commands.chosen_frames(text, range(11))


def test_metrics_take_what_json_does_not():
    values = [metrics.plain(v) for v in (np.float32(0.5), np.inf, np.array([1.0, np.nan]), None, 3)]
    assert values == [0.5, None, [1.0, None], None, 3]
    forces = {("ball", "finger"): 2.0, ("ball", "plane0"): np.nan, ("finger", "plane0"): 1.0}
    found = {"ball": {"finger": 2.0, "plane0": None}, "finger": {"plane0": 1.0}}
    assert metrics.plain(forces) == found


def test_a_new_figure_of_a_measurement_is_in_the_metrics():
    @dataclass(frozen=True)
    class More(Measure):
        deepest: float = 0.5

        @property
        def twice(self) -> float:
            return 2.0 * self.deepest

    values = [0.0] * (len(fields(Measure)) - 1)
    found = metrics.figures(More(*values, forces={}))
    assert (found["deepest"], found["twice"], found["energy"]) == (0.5, 1.0, 0.0)


def test_the_module_runs_as_a_program():
    command = [sys.executable, "-m", "warp_contact", "info", "nothing"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "warp-contact: error: no such file: nothing\n"


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self):
        """Yes."""
        return True


def at(frame: int, time: float) -> SimpleNamespace:
    """What the progress line reads of a simulation."""
    return SimpleNamespace(frame=frame, time=time, substeps=7)


def found(n_contacts: int, overlap: float, itself: float = 0.0) -> SimpleNamespace:
    """What it reads of a measurement."""
    return SimpleNamespace(n_contacts=n_contacts, overlap=overlap, self_overlap=itself)


def test_progress_is_one_line_on_a_terminal():
    stream = Terminal()
    announce("loading", stream=stream)
    with Progress(2, stream=stream) as line:
        line.update(at(1, 1 / 60), found(12, 3.4e-5))
        line.update(at(2, 2 / 60), found(9, 0.0, 0.02))
    text = stream.getvalue()
    assert text.startswith("loading\n")
    assert text.count("\n") == 2
    assert "frame 1 (1/2)  t 0.017 s  7 steps  12 contacts  overlap 3.4e-05 m  0:00 to go" in text
    assert text.rstrip().endswith("overlap 0.0e+00 m  self-overlap 2.0e-02 m  done")


@pytest.mark.parametrize("stream", [io.StringIO(), Terminal()])
def test_progress_is_silent_without_a_terminal_or_when_quiet(stream):
    announce("loading", quiet=stream.isatty(), stream=stream)
    with Progress(1, quiet=stream.isatty(), stream=stream) as line:
        line.update(at(1, 0.1), found(0, 0.0))
    assert stream.getvalue() == ""


def test_a_terminal_that_goes_away_ends_the_line_and_not_the_run():
    class Gone(Terminal):
        def write(self, text):
            raise OSError(5, "Input/output error")

    with Progress(2, stream=Gone()) as line:
        line.update(at(1, 1 / 60), found(0, 0.0))
        line.update(at(2, 2 / 60), found(0, 0.0))
    announce("loading", stream=Gone())


def test_clock():
    assert [clock(s) for s in (4.4, 61, 3600 + 125)] == ["0:04", "1:01", "1:02:05"]


def test_the_installed_command_is_there_and_starts(capsys):
    (found,) = entry_points(group="console_scripts", name="warp-contact")
    assert found.load()(["scenes"]) == 0
    assert "bowl" in capsys.readouterr().out
