"""The loop over the frames, the same for every engine, and the process of one outside. NumPy only.

An engine has those parts of a ``Simulation`` that ``play`` uses, and ``halt()`` for held vertices.
The adapter of an engine outside is a file that calls ``main(make)`` with what makes one of a scene
(``runs.plain``) and a setting, or raises NotImplementedError where it cannot represent the scene.
"""

import os
import pickle
import sys
from functools import partial
from time import process_time

import numpy as np


def main(make) -> None:
    """Run every setting of the job that comes in, write each result as it is there."""
    scene, run, settings = pickle.load(sys.stdin.buffer)
    with open(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # what engines print is no result
        for setting in settings:
            try:
                result = play(partial(make, scene, setting), *run)
            except NotImplementedError as error:
                result = {"reason": f"cannot represent the scene: {error}"}
            except Exception as error:
                result = {"reason": f"{type(error).__name__}: {error}".splitlines()[0]}
            pickle.dump(result, out)
            out.flush()


def play(make, fps: float, frames: int, stop: int | None, limit: float) -> dict:
    """The fields of a ``Motion``, of what ``make()`` returns.

    Times are those of the CPU, in all threads of the process. The first frame, which compiles and
    captures, is not timed. Held vertices stand still after the frame ``stop``; the run is given up
    after ``limit`` seconds.
    """
    begin = process_time()
    engine = make()
    states = [(engine.positions(), engine.velocities())]
    cpu = 0.0
    for frame in range(1, frames + 1):
        if frame - 1 == stop:
            engine.halt()
        start = process_time()
        engine.step_frame()
        cpu += process_time() - start
        if frame == 1:
            startup, cpu = process_time() - begin, 0.0
        states.append((engine.positions(), engine.velocities()))
        rate = cpu * fps / max(frame - 1, 1)
        if not np.isfinite(states[-1][0]).all():
            return {"reason": f"not finite after frame {frame}", "cpu": rate or None}
        if cpu > limit and frame < frames:
            reason = f"too slow: {frame} of {frames} frames in {limit:.3g} s"
            return {"reason": reason, "cpu": rate}
    x, v = map(np.array, zip(*states, strict=True))
    return {"x": x, "v": v, "cpu": rate, "startup": startup, "steps": engine.substeps}
