"""The loop over the frames, the same for every engine, and its process. NumPy only.

An engine is an object with ``step_frame()``, ``state()`` -> (x, v), ``halt()`` for driven vertices,
and ``steps`` of a frame. The adapter of an engine outside is a file with
``make(scene, job, setting)`` that returns one and raises ``CannotDo`` where the engine cannot
represent the scene. It calls ``main(make)``.
"""

import json
import sys
from functools import partial
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
            result = play(partial(make, scene, job, setting), **job["run"])
        except CannotDo as error:
            result = {"reason": f"cannot represent the scene: {error}"}
        except Exception as error:
            result = {"reason": f"{type(error).__name__}: {error}".splitlines()[0]}
        result |= {name: result[name].astype(float) for name in ("x", "v") if name in result}
        part = folder / f"part{k}.npz"
        np.savez(part, **{"reason": "", **result})
        part.rename(folder / f"result{k}.npz")


def play(make, fps: float, frames: int, stop: int | None, limit: float) -> dict:
    """Step all frames; the first one, which compiles and captures, is not timed.

    Args:
        make: returns the engine
        fps: frames per second
        frames: how many
        stop: frame after which driven vertices stand still
        limit: wall seconds after which the run is given up

    Returns:
        the fields of a ``Motion`` but its law; or ``reason`` and ``wall`` of a failure
    """
    begin = perf_counter()
    engine = make()
    states = [engine.state()]
    startup = wall = 0.0
    for frame in range(1, frames + 1):
        if frame - 1 == stop:
            engine.halt()
        start = perf_counter()
        engine.step_frame()
        if frame == 1:
            startup = perf_counter() - begin
        else:
            wall += perf_counter() - start
        states.append(engine.state())
        rate = wall * fps / max(frame - 1, 1)
        if not np.isfinite(states[-1][0]).all():
            return {"reason": f"not finite after frame {frame}", "wall": rate}
        if wall > limit and frame < frames:
            reason = f"too slow: {frame} of {frames} frames in {limit:.3g} s"
            return {"reason": reason, "wall": rate}
    x, v = map(np.array, zip(*states, strict=True))
    return {"x": x, "v": v, "wall": rate, "startup": startup, "steps": engine.steps}


def mean_edge(scene: SimpleNamespace) -> float:
    """Mean edge of the surface triangles of the finest body [m]."""
    a, b = scene.rest[scene.surface], scene.rest[np.roll(scene.surface, 1, axis=1)]
    length = np.linalg.norm(a - b, axis=2).mean(axis=1)
    owner = scene.body[scene.surface[:, 0]]
    return min(float(length[owner == k].mean()) for k in np.unique(owner))
