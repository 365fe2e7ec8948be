"""What every adapter shares: read a scene, step it, time it, write positions. NumPy only.

An adapter is a file with ``make(scene, job, setting)`` that returns an engine: an object with
``step_frame()``, ``state()`` -> (x, v), ``halt()`` for driven vertices, and ``steps`` of a frame.
It calls ``main(make)``. ``make`` raises ``CannotDo`` where the engine cannot represent the scene.
"""

import json
import sys
from pathlib import Path
from time import perf_counter
from types import SimpleNamespace

import numpy as np


class CannotDo(Exception):
    """The engine cannot represent the scene; the message says why."""


def main(make) -> None:
    """Run every setting of the job in the folder that the command line names."""
    folder = Path(sys.argv[1])
    job = json.loads((folder / "job.json").read_text(encoding="utf-8"))
    with np.load(folder / "scene.npz") as arrays:
        scene = SimpleNamespace(**arrays)
    for k, setting in enumerate(job["settings"]):
        try:
            result = play(make, scene, job, setting)
        except CannotDo as error:
            result = {"reason": f"cannot represent the scene: {error}"}
        except Exception as error:
            result = {"reason": f"{type(error).__name__}: {error}".splitlines()[0]}
        part = folder / f"part{k}.npz"
        np.savez(part, **{"reason": "", **result})
        part.rename(folder / f"result{k}.npz")


def play(make, scene: SimpleNamespace, job: dict, setting: dict) -> dict:
    """Step all frames; the first one, which compiles and captures, is not timed."""
    begin = perf_counter()
    engine = make(scene, job, setting)
    frames, fps = job["frames"], job["fps"]
    states = [(scene.x, scene.v)]
    startup = wall = 0.0
    for frame in range(1, frames + 1):
        if frame - 1 == job["stop"]:
            engine.halt()
        start = perf_counter()
        engine.step_frame()
        if frame == 1:
            startup = perf_counter() - begin
        else:
            wall += perf_counter() - start
        x, v = engine.state()
        rate = wall * fps / max(frame - 1, 1)
        if not np.isfinite(x).all():
            return {"reason": f"not finite after frame {frame}", "wall": rate}
        if wall > job["limit"] and frame < frames:
            reason = f"too slow: {frame} of {frames} frames in {job['limit']:.3g} s"
            return {"reason": reason, "wall": rate}
        states.append((x, v))
    return {
        "x": np.array([x for x, _ in states], dtype=np.float64),
        "v": np.array([v for _, v in states], dtype=np.float64),
        "wall": wall / ((frames - 1) / fps),
        "startup": startup,
        "steps": engine.steps,
    }


def mean_edge(scene: SimpleNamespace) -> float:
    """Mean edge of the surface triangles of the finest body [m]."""
    a, b = scene.rest[scene.surface], scene.rest[np.roll(scene.surface, 1, axis=1)]
    length = np.linalg.norm(a - b, axis=2).mean(axis=1)
    owner = scene.body[scene.surface[:, 0]]
    return min(float(length[owner == k].mean()) for k in np.unique(owner))
