"""When what a writer has written is on the disk: what a cut of power cannot take."""

import errno
import os
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from warp_contact import files
from warp_contact.usd import folder
from warp_contact.usd.check import problems
from warp_contact.usd.reader import frame_numbers, open_stage
from warp_contact.usd.writer import UsdWriter

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from fake_simulation import FakeSimulation, written


@pytest.fixture
def on_disk(monkeypatch) -> list[str]:
    """Names of what is put on the disk."""
    found, sync = [], files.sync

    def watched(path):
        sync(path)
        found.append(path.name)

    monkeypatch.setattr(files, "sync", watched)
    return found


def test_what_is_written_is_on_the_disk_within_a_second_and_at_the_end(
    tmp_path, monkeypatch, on_disk
):
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(folder, "time", SimpleNamespace(monotonic=lambda: clock.now))
    folders, sim = {"frames", "run", "run.usda"}, FakeSimulation(n=1)
    with pytest.raises(KeyboardInterrupt), UsdWriter(tmp_path / "run", sim) as writer:
        for sim.frame in range(6):
            on_disk.clear()
            writer.write()
            # 1 s after the first frame, which is published, it is the turn of all since then.
            due = {0: {0}, 3: {1, 2, 3}}.get(sim.frame)
            wanted = {f"f.{frame:06d}.usdc" for frame in due} if due else set()
            assert {name for name in on_disk if name.startswith("f.")} == wanted
            assert (not on_disk) == (not due)
            assert due != {1, 2, 3} or set(on_disk) == wanted | folders
            clock.now += 0.4
        on_disk.clear()
        raise KeyboardInterrupt
    assert set(on_disk) == {"f.000004.usdc", "f.000005.usdc"} | folders
    assert problems(tmp_path / "run") == []


def test_a_run_is_on_the_disk_before_it_takes_the_place_of_another(tmp_path, monkeypatch, on_disk):
    sim = FakeSimulation(n=1)
    written(tmp_path / "run", 2, sim=sim)
    sim.frame = 0
    rename = os.rename

    def watched(*paths):
        moved = {path.name for path in Path(paths[0]).rglob("*") if path.is_file()}
        assert moved == {"run.usda", "topology.usdc", "manifest.usdc", "f.000000.usdc"}
        there.extend(moved & {*on_disk})
        return rename(*paths)

    there: list[str] = []
    monkeypatch.setattr(os, "rename", watched)
    with UsdWriter(tmp_path / "run", sim, overwrite=True) as writer:
        writer.write()
    assert {"run.usda", "f.000000.usdc"} <= {*there}


def test_a_disk_that_fails_later_is_an_error_and_the_writer_tries_again(tmp_path, monkeypatch):
    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("warp_contact.usd.writer.SYNC_EVERY", 0.0)
    sim = FakeSimulation(n=1)
    with UsdWriter(tmp_path / "run", sim) as writer:
        writer.write()
        sim.frame = 1
        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", full)
            with pytest.raises(OSError, match=r"No space left on device: .*f\.000001\.usdc"):
                writer.write()
        writer.write()
    assert len(list(frame_numbers(open_stage(tmp_path / "run")))) == 2


def test_the_root_layer_is_renewed_in_place_and_replaced_where_it_is_another_one(tmp_path):
    root, sim = tmp_path / "run" / "run.usda", FakeSimulation(n=1)
    with UsdWriter(tmp_path / "run", sim) as writer:
        for sim.frame in range(8, 12):
            writer.write()
            if sim.frame == 8:
                first = root.stat()
        assert (first.st_ino, first.st_size) == (root.stat().st_ino, root.stat().st_size)
        root.write_text(root.read_text() + "# longer\n")
        sim.frame = 12
        writer.write()
    assert root.stat().st_size == first.st_size and problems(root) == []
    assert list(frame_numbers(open_stage(root))) == list(range(8, 13))
