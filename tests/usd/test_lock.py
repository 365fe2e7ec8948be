"""usd/lock.py: one holder at a time, and what a killed one leaves."""

import json
import os
import socket
import subprocess
import sys
import threading

import pytest

from warp_contact.usd import lock
from warp_contact.usd.lock import Lock


def test_of_many_that_find_a_lock_left_behind_one_gets_it(tmp_path):
    path, got = tmp_path / "lock", []
    path.write_text(json.dumps({"host": socket.gethostname(), "process": os.getpid()}))
    barrier = threading.Barrier(8)

    def take():
        barrier.wait()
        try:
            got.append(Lock(path))
        except FileExistsError:
            pass

    threads = [threading.Thread(target=take) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(got) == 1
    got[0].release()
    assert not path.exists()


HOLDER = """
import fcntl, json, os, socket, sys
file = open(sys.argv[1], "w")
json.dump({"host": socket.gethostname(), "process": os.getpid()}, file)
file.flush()
fcntl.flock(file, fcntl.LOCK_EX)
print("held", flush=True)
input()
"""


@pytest.mark.skipif(os.name == "nt", reason="locks of POSIX")
def test_another_process_is_named_and_what_it_held_is_free_when_it_is_killed(tmp_path):
    path = tmp_path / "lock"
    command = [sys.executable, "-c", HOLDER, str(path)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as process:
        assert process.stdout.readline() == "held\n"
        with pytest.raises(FileExistsError, match=f"in use by process {process.pid} on"):
            Lock(path)
        process.kill()
        process.wait()
        Lock(path).release()
    assert not path.exists()


@pytest.mark.parametrize("text", ["", "{", "[]", '{"host": 1}'])
def test_a_lock_file_that_nobody_holds_is_taken_over(tmp_path, text):
    path = tmp_path / "lock"
    path.write_text(text)
    Lock(path).release()
    assert not path.exists()


def test_a_lock_of_another_machine_is_left_alone(tmp_path):
    path = tmp_path / "lock"
    path.write_text(json.dumps({"host": "elsewhere", "process": 7}))
    with pytest.raises(FileExistsError, match=r"process 7 on elsewhere: .* remove .*lock"):
        Lock(path)
    assert json.loads(path.read_text())["process"] == 7


def test_where_files_cannot_be_locked_one_left_behind_has_to_be_removed(tmp_path, monkeypatch):
    monkeypatch.setattr(lock, "fcntl", None)
    held = Lock(tmp_path / "lock")
    with pytest.raises(FileExistsError, match="in use"):
        Lock(tmp_path / "lock")
    held.release()
    Lock(tmp_path / "lock").release()
