"""lock.py: one run at a time in a folder."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from warp_contact.command import cli
from warp_contact.command.lock import RunLock
from warp_contact.errors import UsageError

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from command_line import blocks, complaint


def ended() -> int:
    """The number of a process that was."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def lock(folder: Path, host: str, process: int) -> Path:
    """The lock that a run left there."""
    path = folder / "run" / ".run.lock"
    path.parent.mkdir()
    path.write_text(json.dumps({"host": host, "process": process}))
    return path


def test_a_second_run_in_the_same_folder_is_refused_and_leaves_the_first_alone(tmp_path, capsys):
    scene = blocks(tmp_path)
    path = lock(tmp_path, socket.gethostname(), os.getpid())
    assert cli.main(["run", scene, "--out", str(tmp_path / "run"), "--quiet"]) == 2
    assert f"in use by process {os.getpid()}" in complaint(capsys)
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_the_lock_of_a_run_that_was_killed_is_taken_over(tmp_path):
    scene = blocks(tmp_path)
    path = lock(tmp_path, socket.gethostname(), ended())
    out = str(tmp_path / "run")
    assert cli.main(["run", scene, "--out", out, "--frames", "1", "--quiet"]) == 0
    assert not path.exists()


def test_what_runs_elsewhere_or_cannot_be_read_is_not_removed(tmp_path):
    path = lock(tmp_path, "elsewhere", ended())
    for text in (path.read_text(), "{", "[]", ""):
        path.write_text(text)
        with pytest.raises(UsageError, match="in use"), RunLock(tmp_path / "run" / "run.usda"):
            pass
        assert path.read_text() == text


def test_the_lock_goes_with_the_run_whatever_ends_it(tmp_path):
    with pytest.raises(KeyboardInterrupt), RunLock(tmp_path / "a" / "a.usda"):
        assert (tmp_path / "a" / ".a.lock").exists()
        raise KeyboardInterrupt
    assert not (tmp_path / "a").exists()
