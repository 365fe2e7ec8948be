"""warp_contact/usd/threads.py: USD in one thread where the process is that of the command line."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from command_line import blocks

from warp_contact.command import cli

ALONE = """import sys, time
from pxr import Work
from warp_contact.command import cli
assert cli.main() == 0
begin = time.process_time()
time.sleep(0.5)
print(Work.GetConcurrencyLimit(), time.process_time() - begin)
"""


@pytest.mark.parametrize(("given", "wanted"), [({}, 1), ({"PXR_WORK_THREAD_LIMIT": "2"}, 2)])
def test_usd_takes_one_thread_that_does_not_spin_unless_told_otherwise(tmp_path, given, wanted):
    scene, out = blocks(tmp_path), str(tmp_path / "out")
    command = [sys.executable, "-P", "-c", ALONE, "run", scene, "--out", out]
    env = {name: value for name, value in os.environ.items() if not name.startswith("PXR_WORK")}
    done = subprocess.run(command, text=True, capture_output=True, env=env | given, check=True)
    limit, idle = done.stdout.splitlines()[-1].split()
    # A thread that waits without rest takes 0.5 s of a core, or half of one that others use too.
    assert int(limit) == wanted and float(idle) < 0.1


def test_in_a_process_of_others_usd_keeps_its_threads(tmp_path, monkeypatch):
    monkeypatch.setattr(cli, "one_thread", lambda: pytest.fail("the threads of others"))
    command = ["run", blocks(tmp_path), "--out", str(tmp_path / "out"), "--quiet"]
    assert cli.main(command) == 0
