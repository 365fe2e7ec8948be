"""usd/folder.py: one owner, nothing lost, nothing mixed, nothing left behind."""

import gc
import os
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from warp_contact.command import cli
from warp_contact.usd import reader
from warp_contact.usd.check import problems
from warp_contact.usd.folder import RunFolder
from warp_contact.usd.writer import UsdWriter

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from command_line import blocks, complaint
from disk import Full, Kills
from fake_simulation import FakeSimulation, surface_ids, written


def names(place: Path) -> list[str]:
    """All files below a folder."""
    return sorted(str(p.relative_to(place)) for p in place.rglob("*") if not p.is_dir())


def contents(place: Path) -> dict[str, bytes]:
    """All files below a folder with what is in them."""
    return {name: (place / name).read_bytes() for name in names(place)}


def has_frames(place: Path, n: int, sim: FakeSimulation) -> bool:
    """Whether a run holds the frames 0 ... n - 1 of a simulation, and is right."""
    stage = reader.open_stage(place)
    if list(reader.frame_numbers(stage)) != list(range(n)) or problems(place):
        return False
    found = [list(reader.read_points(stage, frame).values()) for frame in range(n)]
    ids = [surface_ids(sim, b) for b in range(2)]
    wanted = [[sim.at(frame)[part] for part in ids] for frame in range(n)]
    return all(np.array_equal(a, b) for a, b in zip(found, wanted, strict=True))


def two() -> tuple[FakeSimulation, FakeSimulation]:
    """Two runs of the same bodies at different places."""
    old, new = FakeSimulation(n=1), FakeSimulation(n=1)
    new.rest = new.rest + np.float32(0.5)
    for body, x in zip(new.scene.bodies, np.split(new.rest, 2), strict=True):
        body.x = x
    return old, new


def hidden(place: Path) -> list[str]:
    """Files below a folder that are hidden, or in a hidden folder."""
    return [name for name in names(place) if "/." in f"/{name}"]


def test_a_second_run_in_a_folder_is_refused_and_leaves_the_first_alone(tmp_path, capsys):
    scene, out = blocks(tmp_path), tmp_path / "run"
    with UsdWriter(out, FakeSimulation()) as writer:
        writer.write()
        before = contents(out)
        for more in (), ("--overwrite",), ("--resume",):
            assert cli.main(["run", scene, "--out", str(out), "--quiet", *more]) == 2
            assert "in use by this process: close what writes there" in complaint(capsys)
        with pytest.raises(FileExistsError, match="in use"):
            UsdWriter(out / "other.usda", FakeSimulation())
        assert contents(out) == before
    assert hidden(out) == []


def test_a_writer_that_was_forgotten_holds_nothing(tmp_path):
    writer = UsdWriter(tmp_path / "run", FakeSimulation())
    writer.write()
    with pytest.raises(FileExistsError, match="in use"):
        UsdWriter(tmp_path / "run", FakeSimulation(), overwrite=True)
    del writer
    gc.collect()
    written(tmp_path / "run", 2, overwrite=True)


def test_a_closed_writer_writes_nothing(tmp_path):
    with UsdWriter(tmp_path / "run", FakeSimulation()) as writer:
        writer.write()
    writer.sim.frame = 1
    with pytest.raises(ValueError, match="is closed"):
        writer.write()


def test_the_lock_and_empty_folders_go_with_what_made_them(tmp_path):
    with pytest.raises(KeyboardInterrupt), RunFolder(tmp_path / "a" / "b"):
        assert names(tmp_path) == ["a/b/.warp_contact.lock"]
        raise KeyboardInterrupt
    with RunFolder(tmp_path / "c" / "d"):
        (tmp_path / "c" / "mine").touch()
    assert names(tmp_path) == ["c/mine"] and not (tmp_path / "c" / "d").exists()


def test_a_second_root_layer_does_not_share_a_folder(tmp_path):
    place = tmp_path / "run"
    written(place / "a.usda", 3)
    (place / "shot.usda").write_text("#usda 1.0\n(subLayers = [@./a.usda@])\n")
    before = contents(place)
    for options in {}, {"overwrite": True}, {"resume": True}:
        with pytest.raises(FileExistsError, match=r"is the folder of a\.usda"):
            UsdWriter(place / "b.usda", FakeSimulation(), **options)
    assert contents(place) == before
    written(place / "a.usda", 1, overwrite=True)  # the user's own layer is none of a run


@pytest.mark.parametrize(
    "name", ["x.usda", "x.usdc", "topology.usdc", "manifest.usdc", "frames/f.000007.usdc"]
)
def test_a_file_of_somebody_else_is_replaced_when_asked_for_and_not_before_a_frame(tmp_path, name):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_text("mine")
    (tmp_path / "frames").mkdir(exist_ok=True)
    (tmp_path / "frames" / "notes.txt").write_text("mine")
    with pytest.raises(FileExistsError, match="is there already"):
        UsdWriter(tmp_path / "x.usda", FakeSimulation())
    with UsdWriter(tmp_path / "x.usda", FakeSimulation(), overwrite=True) as writer:
        assert path.read_text() == "mine"
        writer.write(publish=False)
        assert path.read_text() == "mine"
        writer.sim.frame = 1
        writer.write()
        assert problems(tmp_path) == []
    assert not path.exists() or path.read_bytes() != b"mine"
    assert (tmp_path / "frames" / "notes.txt").read_text() == "mine"


def test_what_is_no_file_or_a_folder_elsewhere_is_never_replaced(tmp_path):
    (tmp_path / "x.usda").mkdir()
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "frames").symlink_to(tmp_path)
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "frames").touch()
    for name in "x.usda", "a", "b":
        with pytest.raises(FileExistsError, match="is in the way"):
            UsdWriter(tmp_path / name, FakeSimulation(), overwrite=True)
    assert names(tmp_path) == ["b/frames"]


def test_files_of_killed_processes_are_cleared_away_and_no_others(tmp_path):
    written(tmp_path / "run", 1)
    place = tmp_path / "run"
    ours = ".warp_contact.12.0a.usdc", "frames/.warp_contact.12.0b.usdc", ".warp_contact.lock"
    theirs = ".hidden", ".warp_contact.txt", "frames/.tmp.usdc"
    (place / ".warp_contact.new").mkdir()
    (place / ".warp_contact.new" / "topology.usdc").touch()
    for name in ours + theirs:
        (place / name).touch()
    with pytest.raises(FileExistsError, match="is there already"):
        RunFolder(place)
    assert set(hidden(place)) == set(theirs)


def is_whole(place: Path, finished: int, old: FakeSimulation, new: FakeSimulation) -> bool:
    """Whether a folder holds the 3 frames of the old run, or those finished of the new one.

    The last frame may have been finished before the writer could say so.
    """
    may = [n for n in (finished, finished + 1) if n]
    return (not finished and has_frames(place, 3, old)) or any(
        has_frames(place, n, new) for n in may
    )


def test_a_full_disk_loses_no_frame_and_leaves_nothing_torn(tmp_path, monkeypatch):
    """At every call of a run over an earlier one; then there is room again."""
    old, new = two()
    k, finished = 0, 0
    while finished < 4:
        place = tmp_path / str(k)
        written(place, 2, sim=old)
        finished = 0
        with monkeypatch.context() as patch, suppress(OSError):
            Full(patch, k)
            with UsdWriter(place, new, overwrite=True) as writer:
                for new.frame in range(4):
                    writer.write()
                    finished = new.frame + 1
        RunFolder(place, resume=True).close()  # as the next one does
        assert is_whole(place, finished, old, new), k
        assert hidden(place) == []
        k += 1
    assert k > 30


def test_a_frame_that_found_no_room_can_be_written_later(tmp_path, monkeypatch):
    sim = FakeSimulation(n=1)
    with UsdWriter(tmp_path / "run", sim) as writer:
        writer.write()
        for sim.frame in range(1, 4):
            for k in range(3):
                with monkeypatch.context() as patch:
                    Full(patch, k)
                    with pytest.raises(OSError, match="No space"):
                        writer.write()
                assert has_frames(tmp_path / "run", sim.frame, sim)
            writer.write()
    assert has_frames(tmp_path / "run", 4, sim)


def test_a_frame_that_usd_cannot_finish_is_an_error_that_names_it(tmp_path):
    resource, sim = pytest.importorskip("resource"), FakeSimulation(n=8)
    limit, (soft, hard) = resource.RLIMIT_FSIZE, resource.getrlimit(resource.RLIMIT_FSIZE)
    with UsdWriter(tmp_path / "run", sim) as writer:
        writer.write()
        sim.frame = 1
        resource.setrlimit(limit, (2048, hard))  # [bytes] of a file: USD leaves it cut short
        try:
            with pytest.raises(OSError, match=r"cannot write .*f\.000001\.usdc: .*too large"):
                writer.write()
        finally:
            resource.setrlimit(limit, (soft, hard))
        assert [path.name for path in (tmp_path / "run" / "frames").iterdir()] == ["f.000000.usdc"]
        writer.write()
    assert has_frames(tmp_path / "run", 2, sim)


def test_a_kill_at_any_moment_loses_no_frame_and_mixes_none(tmp_path, monkeypatch):
    """Before every change of the folder, in a run over an earlier one."""
    (old, new), place = two(), tmp_path / "run"
    written(place, 2, sim=old)
    with monkeypatch.context() as patch:
        kills = Kills(patch, place, tmp_path)
        kills.said = 0
        with UsdWriter(place, new, overwrite=True) as writer:
            for new.frame in range(4):
                writer.write()
                kills.said = new.frame + 1
    assert len(kills.copies) > 30
    for copy, finished in zip(kills.copies, kills.done, strict=True):
        # For a moment nothing is to be seen, but all is still there.
        assert not (copy / "run.usda").exists() or is_whole(copy, finished, old, new)
        RunFolder(copy, resume=True).close()
        assert is_whole(copy, finished, old, new)
        assert hidden(copy) == []


@pytest.mark.parametrize(
    "name", ["new\nline", "tab\t", "back\\slash", "a:SDF_FORMAT_ARGS:b", os.fsdecode(b"bad\xff")]
)
def test_a_name_that_usd_cannot_open_is_refused_before_anything_is_made(tmp_path, name):
    for path in tmp_path / name, tmp_path / name / "inner" / "x.usda":
        with pytest.raises(ValueError, match="USD opens no file with"):
            RunFolder(path)
    (tmp_path / name).mkdir()
    with pytest.raises(OSError, match="USD opens no file with"):
        (tmp_path / name / "x.usda").touch()
        reader.open_stage(tmp_path / name / "x.usda")


@pytest.mark.parametrize(
    "name",
    ["[x]", "{y}", "a b", "ünï 世界", "f.######", "a%c#d", "-dash", "*", "?", "'\"", "<UDIM>"],
)
def test_any_other_name_works(tmp_path, name):
    sim = FakeSimulation(n=1)
    written(tmp_path / name, 2, sim=sim, flatten=True)
    assert has_frames(tmp_path / name, 3, sim)
    assert problems(tmp_path / name / f"{name}.usdc") == []
    sim.frame = 1
    UsdWriter(tmp_path / name, sim, resume=True).close()
    assert has_frames(tmp_path / name, 2, sim)


def test_the_hidden_names_are_short_enough_for_the_longest_that_fit(tmp_path):
    name = "n" * 250  # with .usda 255, the most that common file systems take
    written(tmp_path / name, 1)
    assert problems(tmp_path / name) == []
    with pytest.raises(OSError, match="too long"):
        RunFolder(tmp_path / ("n" * 251))
    assert len(names(tmp_path)) == 5 and hidden(tmp_path) == []
