"""What --resume does with a run that was damaged: it mends it, or says what it cannot."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from warp_contact.command import cli
from warp_contact.usd import reader
from warp_contact.usd.check import problems

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from command_line import blocks, complaint

FRAMES = 6  # of the run that is damaged; two more are added


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A finished run to damage, and the longer one that it shall become."""
    place = tmp_path_factory.mktemp("runs")
    scene = blocks(place)
    for name, frames in ("run", FRAMES), ("whole", FRAMES + 2):
        command = ["run", scene, "--out", str(place / name), "--frames", str(frames), "--quiet"]
        assert cli.main(command) == 0
    return place


def files(place: Path) -> dict[str, bytes]:
    """All files below a folder."""
    found = (p for p in place.rglob("*") if p.is_file())
    return {p.relative_to(place).as_posix(): p.read_bytes() for p in found}


@pytest.fixture
def out(runs, tmp_path):
    """A copy of the finished run."""
    for name, data in files(runs / "run").items():
        path = tmp_path / "run" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return tmp_path / "run"


def resume(runs, out) -> int:
    """Go on with a run."""
    command = ["run", str(runs / "blocks.py"), "--out", str(out), "--quiet", "--resume"]
    return cli.main([*command, "--frames", str(FRAMES + 2)])


def frame(n: int) -> str:
    """The name of a frame's file."""
    return f"frames/f.{n:06d}.usdc"


def gone(path: Path) -> None:
    path.unlink()


def empty(path: Path) -> None:
    path.write_bytes(b"")


def torn(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def garbage(path: Path) -> None:
    path.write_bytes(np.random.default_rng(0).bytes(3000))


def shorter(path: Path) -> None:
    path.write_text(path.read_text().replace(f"endTimeCode = {FRAMES}", "endTimeCode = 2"))


def without_end(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1])


def torn_line(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-20])


def lost_line(path: Path) -> None:
    path.write_text("".join(path.read_text().splitlines(keepends=True)[1:]))


def doubled_line(path: Path) -> None:
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:3], *lines[2:]]))


MENDED = [("topology.usdc", gone), ("topology.usdc", torn), ("topology.usdc", garbage)]
MENDED += [("manifest.usdc", gone), ("manifest.usdc", torn), ("manifest.usdc", empty)]
MENDED += [("run.usda", gone), ("run.usda", torn), ("run.usda", empty), ("run.usda", shorter)]
MENDED += [("metrics.jsonl", damage) for damage in (gone, torn, empty, garbage, without_end)]
MENDED += [("metrics.jsonl", damage) for damage in (torn_line, lost_line, doubled_line)]


@pytest.mark.parametrize(("name", "damage"), MENDED)
def test_what_follows_from_the_frames_is_mended(runs, out, name, damage):
    damage(out / name)
    assert resume(runs, out) == 0
    assert problems(out) == []
    lines = (out / "metrics.jsonl").read_text()
    assert lines == (runs / "whole" / "metrics.jsonl").read_text()
    found, wanted = (
        reader.open_stage(place / root) for place, root in ((out, "run.usda"), (runs, "whole"))
    )
    assert list(reader.frame_numbers(found)) == list(range(FRAMES + 3))
    options = {"addSourceFileComment": False}
    assert found.Flatten(**options).ExportToString() == wanted.Flatten(**options).ExportToString()


def other(path: Path) -> None:
    path.write_bytes((path.parent / "f.000001.usdc").read_bytes())


def changed(**values):
    """Put other values into a checkpoint; None takes one out."""

    def change(path: Path) -> None:
        with np.load(path) as file:
            kept = dict(file)
        for name, value in values.items():
            kept[name] = value(kept[name]) if value else None
        np.savez(path, **{name: value for name, value in kept.items() if value is not None})

    change.__name__ = f"changed_{'_'.join(values)}"
    return change


def flipped(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[data.find(b"x.npy") + 200] ^= 255
    path.write_bytes(data)


def no_number(x):
    return np.where(np.arange(x.size).reshape(x.shape) == 7, np.nan, x).astype(x.dtype)


REFUSED = [(frame(3), damage, "000003.usdc is damaged") for damage in (torn, empty, garbage)]
REFUSED += [(frame(n), gone, f"frame {n} is missing") for n in (0, 3, FRAMES)]
REFUSED += [(frame(FRAMES), torn, "is damaged"), (frame(0), empty, "is damaged")]
REFUSED += [(frame(3), other, "000003.usdc is not frame 3"), (frame(0), other, "is not frame 0")]
REFUSED += [("checkpoint.npz", gone, "nothing to resume")]
REFUSED += [
    ("checkpoint.npz", d, "checkpoint.npz is no checkpoint") for d in (torn, empty, garbage)
]
REFUSED += [("checkpoint.npz", flipped, "damaged")]
REFUSED += [
    ("checkpoint.npz", changed(**{name: change}), "checkpoint.npz is damaged")
    for name, change in (
        ("x", no_number),
        ("x", lambda x: x[:-3]),
        ("v", None),
        ("v", lambda v: v.astype(np.float64)),
        ("frame", lambda frame: np.array(-1)),
        ("frame", lambda frame: np.array(3)),
    )
]


@pytest.mark.parametrize(("name", "damage", "words"), REFUSED)
def test_what_cannot_be_mended_is_said_and_nothing_is_changed(
    runs, out, name, damage, words, capsys
):
    damage(out / name)
    before = files(out)
    assert resume(runs, out) == 2
    said = complaint(capsys)
    assert words in said and "--overwrite" in said
    assert files(out) == before


def test_a_frame_after_the_checkpoint_does_not_matter(runs, out):
    (out / frame(FRAMES + 1)).write_text("torn")
    with (out / "metrics.jsonl").open("a") as file:
        file.write('{"frame": 7, "ti')
    assert resume(runs, out) == 0
    assert problems(out) == []
    lines = (out / "metrics.jsonl").read_text().splitlines()
    assert [json.loads(line)["frame"] for line in lines] == list(range(FRAMES + 3))
    assert (out / "metrics.jsonl").read_text() == (runs / "whole" / "metrics.jsonl").read_text()


def test_the_files_of_another_root_layer_are_not_taken_for_this_one(runs, out, capsys):
    (out / "run.usda").rename(out / "older.usda")
    assert resume(runs, out) == 2
    assert "is the folder of older.usda" in complaint(capsys)
    assert resume(runs, out / "older.usda") == 0
    (out / "older.usda").write_text("#usda 1.0\n")
    assert resume(runs, out / "older.usda") == 2
    assert "is not the root layer of a run" in complaint(capsys)


def test_frames_of_a_run_with_other_attributes_are_not_gone_on_with(runs, out, capsys):
    (out / "manifest.usdc").write_bytes((out / frame(2)).read_bytes())
    assert resume(runs, out) == 2
    assert "was written with other arguments" in complaint(capsys)
