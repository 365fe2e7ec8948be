"""interrupts.py: the command line ends at once, in one line, whenever it is told to."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent))
from command_line import blocks, complaint

from warp_contact import interrupts
from warp_contact.command import cli
from warp_contact.simulation import Simulation
from warp_contact.usd import reader
from warp_contact.usd.check import problems

SIGNALS = [getattr(signal, name) for name in interrupts.NAMES if hasattr(signal, name)]

# Sends a signal to its own process as it begins to import a package.
SITE = """
import os, sys


class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == os.environ["AT"]:
            os.kill(os.getpid(), int(os.environ["SIGNAL"]))


sys.meta_path.insert(0, Finder())
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("at", ["warp", "warp_contact.scenes.two_bodies"])
def test_a_signal_while_it_imports_ends_the_program_in_one_line(tmp_path, number, at):
    (tmp_path / "sitecustomize.py").write_text(SITE)
    paths = [str(tmp_path), str(Path(interrupts.__file__).parents[1])]
    environment = dict(
        os.environ, AT=at, SIGNAL=str(int(number)), PYTHONPATH=os.pathsep.join(paths)
    )
    command = [sys.executable, "-P", "-m", "warp_contact", "run", "two_bodies", "--out"]
    done = subprocess.run(
        [*command, str(tmp_path / "out")],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 128 + number
    assert done.stderr.strip() == "warp-contact: error: interrupted"
    assert not (tmp_path / "out").exists()


def told(monkeypatch, method: str, tell) -> None:
    """Tell the process something as a method of the simulation is called after frame 1."""
    whole = getattr(Simulation, method)

    def telling(self, *args):
        if self.frame == 1:
            tell()
        return whole(self, *args)

    monkeypatch.setattr(Simulation, method, telling)


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("method", ["step_frame", "measure", "positions"])
def test_a_signal_during_a_run_keeps_what_is_finished(
    tmp_path, number, method, monkeypatch, capsys
):
    before = [signal.getsignal(each) for each in SIGNALS]
    told(monkeypatch, method, lambda: signal.raise_signal(number))
    out = tmp_path / "out"
    assert cli.main(["run", blocks(tmp_path), "--out", str(out)]) == 128 + number
    assert "interrupted" in complaint(capsys)
    assert [signal.getsignal(each) for each in SIGNALS] == before
    assert reader.open_stage(out).GetEndTimeCode() == (1 if method == "step_frame" else 0)
    assert problems(out) == []
    assert [p.name for p in out.rglob(".*")] == []


class Dropped:
    """Is told to end where Python drops the exception."""

    def __del__(self):
        """Raise a signal."""
        signal.raise_signal(signal.SIGINT)


def test_a_signal_whose_exception_python_drops_ends_the_run_after_the_frame(
    tmp_path, monkeypatch, capsys
):
    told(monkeypatch, "step_frame", Dropped)
    assert cli.main(["run", blocks(tmp_path), "--out", str(tmp_path / "out")]) == 130
    assert "interrupted" in complaint(capsys)
    assert reader.open_stage(tmp_path / "out").GetEndTimeCode() == 2


def test_a_second_signal_does_not_wait_for_anything(monkeypatch):
    class Left(BaseException):
        pass

    def leave(code):
        raise Left(code)

    monkeypatch.setattr(os, "_exit", leave)
    with pytest.raises(Left, match="143"), interrupts.Raised():
        with pytest.raises(interrupts.Interrupted):
            signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGTERM)


def test_a_signal_that_is_ignored_stays_so():
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with interrupts.Raised():
            signal.raise_signal(signal.SIGTERM)
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGTERM, before)


def test_a_thread_may_run_a_command(capsys):
    codes = []
    thread = threading.Thread(target=lambda: codes.append(cli.main(["scenes"])))
    thread.start()
    thread.join()
    assert codes == [0]
