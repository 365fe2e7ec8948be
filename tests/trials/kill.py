"""Kill ``warp-contact run`` at random moments, see what it leaves, resume it; again and again.

python tests/trials/kill.py two_bodies 12 100 1    # scene, frames, kills, seed

Every other run goes over an earlier one, which must be whole until the new one is. After each kill
all frames must have the bits of a run that was never killed, and none that a checkpoint counts on
may be missing; at the end nothing may be left behind. The exit code is 1 if anything was lost.
"""

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import numpy as np

from warp_contact.usd import reader
from warp_contact.usd.check import problems

# Checkpoints come every 0.1 s, as the runs are short.
CODE = """import sys
from warp_contact.command import cli, run
run.SAVE_EVERY = 0.1
sys.exit(cli.main())"""


class Trial:
    """Runs of one scene, and ``found``: how often what happened to them."""

    def __init__(self, place: Path, scene: str, frames: int, seed: int):
        """Run it once without a kill."""
        self.place, self.scene, self.frames = place, scene, frames
        self.rng, self.found = random.Random(seed), Counter()
        self.start("old", "--fps", "30", "--frames", "2").wait()
        begun = time.monotonic()
        assert self.start("whole").wait() == 0, f"{scene} does not run"
        self.seconds = time.monotonic() - begun
        self.old, self.whole = self.points("old"), self.points("whole")

    def start(self, name: str, *more: str) -> subprocess.Popen:
        """Start a run."""
        command = [sys.executable, "-P", "-c", CODE, "run", self.scene, "--quiet"]
        command += ["--frames", str(self.frames), "--out", str(self.place / name), *more]
        return subprocess.Popen(command, stderr=subprocess.PIPE, text=True)

    def points(self, name: str) -> list[dict[str, np.ndarray]]:
        """Surface points of the frames that can be read."""
        if not (self.place / name / f"{name}.usda").exists():
            return []
        stage = reader.open_stage(self.place / name)
        for problem in problems(stage):
            self.note("wrong", problem)
        return [reader.read_points(stage, frame) for frame in reader.frame_numbers(stage)]

    def note(self, what: str, why: str) -> None:
        """Count what went wrong, and say it."""
        self.found[what] += 1
        print(f"{what}: {why}", flush=True)

    def kill(self, process: subprocess.Popen, out: Path) -> bool:
        """Kill it after a while, or when it has written so many hidden files; False if it ended."""
        until = time.monotonic() + self.rng.uniform(0.2, 1.0) * self.seconds
        hidden, seen = self.rng.choice([0, 0, self.rng.randrange(1, 5 * self.frames)]), set()
        while process.poll() is None:
            time.sleep(1e-3)
            with suppress(FileNotFoundError):  # folders that go while they are looked at
                seen |= {path.name for path in out.rglob(".warp_contact.*")}
            if len(seen) >= hidden if hidden else time.monotonic() > until:
                process.send_signal(signal.SIGKILL)
                break
        process.wait()
        return process.returncode == -signal.SIGKILL

    def run(self, kills: int, over: bool) -> None:
        """One run, killed until it reaches its end or ``kills`` are reached."""
        out, sure = self.place / "run", 0
        shutil.rmtree(out, ignore_errors=True)
        if over:
            shutil.copytree(self.place / "old", out)
            (out / "old.usda").rename(out / "run.usda")
        option = "--overwrite" if over else ""
        while True:
            process = self.start("run", *filter(None, [option]))
            if self.found["kills"] == kills or not self.kill(process, out):
                if process.wait():
                    self.note("failed", process.stderr.read().strip())
                break
            self.found["kills"] += 1
            self.found["with hidden files"] += any(out.rglob(".warp_contact.*"))
            sure, option = self.look(out, sure, over)
        lines = [(self.place / name / "metrics.jsonl").read_text() for name in ("run", "whole")]
        if not same(self.points("run"), self.whole) or lines[0] != lines[1]:
            self.note("lost", "the finished run is another one")
        for path in out.rglob(".*"):
            self.note("litter", path.name)

    def look(self, out: Path, sure: int, over: bool) -> tuple[int, str]:
        """See what a kill left; return the frames that must stay, and how to go on."""
        points = self.points("run")
        if over and not sure and same(points, self.old):
            return 0, "--overwrite"
        if (out / ".warp_contact.ready").exists():  # half way from one to the other
            return sure, "--resume"
        if not same(points, self.whole[: len(points)]):
            self.note("wrong", "frames of another run")
        if not (over or points):
            return 0, ""
        try:
            sure = max(sure, int(np.load(out / "checkpoint.npz")["frame"]) + 1)
        except Exception as error:  # whatever a torn file leads to
            self.note("lost", f"the checkpoint: {error}")
            return 0, "--overwrite"
        if len(points) < sure:
            self.note("lost", f"{len(points)} frames, there were {sure}")
        return sure, "--resume"


def same(a: list[dict], b: list[dict]) -> bool:
    """Whether two runs have the same bits."""
    pairs = [(p[k], q.get(k)) for p, q in zip(a, b, strict=False) for k in p]
    return len(a) == len(b) and all(np.array_equal(x, y) for x, y in pairs)


def main() -> int:
    """Kill, and say what was found."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    for name, kind in ("scene", str), ("frames", int), ("kills", int), ("seed", int):
        parser.add_argument(name, type=kind)
    args = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    with tempfile.TemporaryDirectory() as place:
        trial = Trial(Path(place), args.scene, args.frames, args.seed)
        while trial.found["kills"] < args.kills:
            trial.run(args.kills, over=bool(trial.found["runs"] % 2))
            trial.found["runs"] += 1
    names = "runs", "kills", "with hidden files", "lost", "wrong", "failed", "litter"
    print(", ".join(f"{trial.found[name]} {name}" for name in names))
    return int(any(trial.found[name] for name in names[3:]))


if __name__ == "__main__":
    sys.exit(main())
