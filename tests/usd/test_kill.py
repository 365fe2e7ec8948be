"""usd/writer.py: a writer that is killed at any moment leaves a valid file."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from warp_contact.usd import reader
from warp_contact.usd.check import problems

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import fake_simulation
from fake_simulation import FakeSimulation, surface_ids

KILLS = 10


def killed_writer(out: Path, rng: np.random.Generator) -> int:
    """The last frame that a writer finished before it was killed at a random moment."""
    command = [sys.executable, fake_simulation.__file__, str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        while process.stdout.readline() != "start\n":
            assert process.poll() is None
        time.sleep(rng.uniform(0.0, 0.5))
        process.send_signal(signal.SIGKILL)
        said = process.stdout.read().split("\n")[:-1]  # without a line that is cut off
    return int(said[-1]) if said else -1


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
def test_a_killed_writer_loses_no_finished_frame(tmp_path, rng):
    sim = FakeSimulation()
    ids = [surface_ids(sim, b) for b in range(2)]
    for kill in range(KILLS):
        out = tmp_path / str(kill)
        finished = killed_writer(out, rng)
        stage = reader.open_stage(out)
        assert stage.GetEndTimeCode() >= finished, kill
        assert problems(stage) == [], kill
        for frame in range(finished + 1):
            points = reader.read_points(stage, frame)
            np.testing.assert_array_equal(points["left"], sim.at(frame)[ids[0]])
            np.testing.assert_array_equal(points["right"], sim.at(frame)[ids[1]])
