"""What the commands are given: damaged files and scene files end in one line, soon."""

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from command_line import complaint

from warp_contact.command import cli
from warp_contact.command.commands import chosen_frames
from warp_contact.scene.shapes import box
from warp_contact.scene.topology import MeshError

STAGE = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    kilogramsPerUnit = 1
    upAxis = "Z"
    startTimeCode = {start}
    endTimeCode = {end}
    timeCodesPerSecond = {rate}
    framesPerSecond = {rate}
)
def Xform "World"
{{
    def Xform "b"
    {{
        custom uniform int userProperties:body = 0
        {label}
        def Mesh "b"
        {{
            point3f[] points = {points}
            float3[] extent = [(0,0,0), (1,1,1)]
            int[] faceVertexCounts = {counts}
            int[] faceVertexIndices = {indices}
            uniform token subdivisionScheme = "none"
        }}
    }}
}}
"""
GOOD = {
    "start": "0",
    "end": "0",
    "rate": "60",
    "label": 'custom uniform string userProperties:label = "b"',
    "points": "[(0,0,0), (1,0,0), (0,1,0), (0,0,1)]",
    "counts": "[3,3,3,3]",
    "indices": "[1,2,3,0,3,2,0,1,3,0,2,1]",
}


@pytest.fixture
def stage(tmp_path):
    """Writes a stage with a tet, some of it replaced."""

    def write(**given) -> str:
        path = tmp_path / "a.usda"
        path.write_text(STAGE.format(**GOOD | given))
        return str(path)

    return write


def test_a_stage_as_it_should_be_is_read_by_every_command(stage, capsys, tmp_path):
    path = stage()
    assert cli.main(["info", path]) == 0
    assert cli.main(["validate", path]) == 0
    assert cli.main(["render", path, "--size", "16x9", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "000000.png").stat().st_size > 0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"end": "1e9"}, "a.usda says that its frames go from 0 to 1e+09: correct its start"),
        ({"end": "inf"}, "its frames go from 0 to inf"),
        ({"start": "nan"}, "its frames go from nan to 0"),
        ({"start": "5"}, "its frames go from 5 to 0"),
        ({"rate": "0"}, "invalid value for field"),
        ({"label": ""}, "a.usda: /World/b lacks the number, label or surface of a body"),
        (
            {"counts": "[3,3,3,2000000000]"},
            "a.usda: /World/b/b do not fit its 4 points",
        ),
        ({"indices": "[1,2,3,0,3,2,0,1,3,0,2,-9]"}, "do not fit its 4 points"),
        ({"points": "[(nan,0,0), (1,0,0), (0,1,0), (0,0,1)]"}, "that are not finite"),
        ({"points": "[]"}, "do not fit its 0 points"),
        ({"points": "[(0,0,0) 7]"}, "is not a readable USD file"),
    ],
)
def test_a_damaged_stage_ends_every_command_in_one_line(given, words, stage, tmp_path, capsys):
    path, said = stage(**given), []
    for command in ("info", "validate", "render"):
        more = ["--size", "16x9", "--out", str(tmp_path)] if command == "render" else []
        code = cli.main([command, path, *more])
        out, err = capsys.readouterr()
        said.append(out + err)
        assert code == 0 or (command == "validate" and out) or err.count("\n") == 1
        assert code < 2 and "Traceback" not in err and "Error:" not in out + err
    assert any(words in text for text in said), said


def test_what_would_hang_a_command_is_ended(stage, capsys, tmp_path, monkeypatch):
    def hangs(*_):
        raise MeshError("a.usda: reading it took more than 10 s: it is damaged; write it anew")

    path = stage()
    os.mkfifo(tmp_path / "pipe.usda")
    for command in ("info", "validate", "render"):
        assert cli.main([command, str(tmp_path / "pipe.usda")]) == 1
        assert "no file but a pipe or a device" in "".join(capsys.readouterr())
    monkeypatch.setattr("warp_contact.command.commands.in_child", hangs)
    for command in ("info", "validate", "render"):
        assert cli.main([command, path]) == 1
        assert "reading it took more than 10 s" in "".join(capsys.readouterr())


def test_a_warning_is_one_line_too(tmp_path, capsys):
    box(85.0, 1).save(tmp_path / "a.npz")
    assert cli.main(["info", str(tmp_path / "a.npz")]) == 0
    err = capsys.readouterr().err
    assert err.startswith("warp-contact: warning: ") and err.count("\n") == 1
    assert "85 m large" in err


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import sys\nsys.exit(0)", "SystemExit: 0"),
        ("def build():\n    import sys\n    sys.exit(0)", "SystemExit: 0"),
        ("def build():\n    pass", "what build() returns, None: give a wc.Scene"),
        ("def build():\n    return 3", "what build() returns, 3: give a wc.Scene"),
        (
            "VIEW = {'eye': (1, 1, 1), 'target': (1, 1, 1)}",
            "[1.0, 1.0, 1.0]: give another place",
        ),
        ("VIEW = {'eye': (1, 1, 1)}", "VIEW {'eye': (1, 1, 1)}: give {'eye': (x, y, z)"),
        ("VIEW = {'eye': (1, 1, 1), 'target': 'up'}", "VIEW target 'up': give finite numbers"),
        ("FRAMES = -1", "FRAMES -1: give a whole number from 1"),
        ("PENALTY = {'stiffness': -1.0}", "penalty stiffness -1.0: give a number above 0"),
        ("PENALTY = 3", "PENALTY"),
    ],
)
def test_a_scene_file_that_makes_no_scene_is_wrong_usage(text, words, tmp_path, capsys):
    path = tmp_path / "scene.py"
    path.write_text(text if "build" in text else f"{text}\ndef build():\n    pass")
    assert cli.main(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    said = complaint(capsys)
    assert words in said and "scene.py" in said
    assert not (tmp_path / "out").exists()


def test_frames_are_chosen_of_those_that_are_there_however_many_are_named():
    assert chosen_frames("0:1000000000000:2", range(5)) == [0, 2, 4]
    assert chosen_frames("1000000000000:1:-1", range(5)) == [4, 3, 2]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--size", "100000x10"], "size 100000: give a whole number from 1 to 16384"),
        (["--samples", "100000"], "samples 100000: give a whole number from 1 to 64"),
        (["--wire", "nan"], "wire nan: give a number from 0 to 1"),
        (["--eye", "nan", "0", "0"], "eye [nan, 0.0, 0.0]: give finite numbers"),
        (["--eye", "1", "1", "1", "--target", "1", "1", "1"], "another place than that of the"),
    ],
)
def test_a_picture_that_cannot_be_made_is_refused(arguments, words, stage, capsys, tmp_path):
    assert cli.main(["render", stage(), "--out", str(tmp_path / "out"), *arguments]) == 1
    assert words in complaint(capsys)
    assert not (tmp_path / "out").exists()
