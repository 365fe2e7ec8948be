"""What sweeps of the tests run, in other processes: ``python swept.py FOLDER`` is one of them."""

import hashlib
import os
import signal
import sys
import time
from pathlib import Path

import numpy as np

import warp_contact as wc


def square(x: float) -> dict:
    """Its square, in an array and alone."""
    return {"x": np.array([x, x * x]), "square": np.float64(x * x)}


def cube(x: float) -> float:
    """Its third power."""
    return x**3


def noted(x: int, folder: str) -> int:
    """Leave a note each time that it begins; return how many there are."""
    with (Path(folder) / f"{x}.txt").open("a") as file:
        file.write(f"{os.getpid()}\n")
    return len((Path(folder) / f"{x}.txt").read_text().splitlines())


def killed(x: int, folder: str, times: int = 1) -> int:
    """Be killed so many times where ``x`` is odd."""
    begun = noted(x, folder)
    if x % 2 and begun <= times:
        os.kill(os.getpid(), signal.SIGKILL)
    return x


def missing(x: int, folder: str) -> int:
    """Fail where ``x`` is 1 as long as a file is missing."""
    noted(x, folder)
    if x == 1 and not (Path(folder) / "there").exists():
        raise ValueError("the file is missing")
    return x


def waits(x: int, folder: str) -> int:
    """End at once where ``x`` is 0, else once a file is there."""
    noted(x, folder)
    while x and not (Path(folder) / "there").exists():
        time.sleep(0.01)
    return x


def bits(young: float) -> str:
    """A digest of where a ball is that was dropped onto another."""
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0))
    for z in (0.05, 0.151):
        scene.add_body(wc.sphere(0.05, 41), wc.NeoHookean(young, 0.3, 1000.0), (0.0, 0.0, z))
    sim = wc.Simulation(scene)
    for _ in sim.frames(2):
        pass
    return hashlib.sha256(sim.positions().tobytes() + sim.velocities().tobytes()).hexdigest()


def cases(folder, n: int = 4) -> list[dict]:
    """Of those above that leave notes in a folder."""
    return [{"x": x, "folder": str(folder)} for x in range(n)]


if __name__ == "__main__":
    print(wc.sweep(waits, cases(sys.argv[1]), 1, out=sys.argv[1]))
