"""Run a task with many methods, one after the other: our own, then those of engines outside.

These get plain arrays and hand back positions. The adapter of an engine, a file beside this one,
runs all settings of a task in a process of its own, under an interpreter that may have other
packages. Each result is written as it comes: a process which dies takes none with it.
"""

import io
import pickle
import resource
import signal
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from engines import ours
from engines.task import Motion, Numbered, Task

ENGINES = {  # their adapters
    "Newton VBD": "newton_solvers.py",
    "Newton XPBD": "newton_solvers.py",
    "MuJoCo flex": "mujoco_flex.py",
}
KNOBS = {  # and their values, setting by setting; the adapters explain them
    "Newton VBD": {
        "steps": (2, 5, 2, 5, 5, 10, 10, 10, 20, 5),
        "iterations": (5, 5, 5, 5, 5, 10, 10, 10, 20, 5),
        "contact": (1, 1, 10, 10, 10, 1, 10, 10, 10, 1),
        "margin": (0.1, 0.1, 0.002, 0.02, 0.002, 0.1, 0.02, 0.002, 0.002, 0.02),
    },
    "Newton XPBD": {
        "steps": (5, 10, 10, 5, 10, 10, 32, 32, 10, 20),
        "iterations": (10, 2, 10, 10, 10, 20, 2, 10, 2, 10),
        "relaxation": (0.2, 0.2, 0.2, 0.2, 0.2, 0.1, 0.2, 0.4, 0.2, 0.1),
        "radius": (0.3, 0.3, 0.3, 0.43, 0.43, 0.3, 0.3, 0.3, 0.43, 0.43),
    },
    "MuJoCo flex": {
        "steps": (1, 2, 4, 2, 4, 8, 16, 8, 16, 16),
        "iterations": (20, 20, 20, 20, 20, 20, 20, 20, 20, 100),
        "time_constant": (2, 2, 2, 2, 2, 2, 2, 2, 2, 10),
        "radius": (0.01, 0.01, 0.01, 1e-4, 1e-4, 0.01, 0.01, 1e-4, 1e-4, 0.01),
    },
}
SWEEPS = {
    engine: [dict(zip(knobs, row, strict=True)) for row in zip(*knobs.values(), strict=True)]
    for engine, knobs in KNOBS.items()
}
GRACE = 300.0  # CPU s for imports and kernels, on top of the limits of the runs
VERSIONS = """from importlib import metadata as m
for p in "newton", "mujoco", "warp-lang":
    print(p, m.version(p) if list(m.distributions(name=p)) else "not installed")"""


def runs(
    task: Task, own: Iterable[ours.Own], others: dict[str, list], python: str, limit: float
) -> Iterator[tuple[str, str, Motion]]:
    """Method, knobs as text and motion of all our ``own`` settings and those of the ``others``.

    The others are parts of ``SWEEPS``, their engines those of the interpreter ``python``. A run is
    given up after ``limit`` CPU seconds. Steps of our own are their own, or multiples of those that
    the same method takes by itself.
    """
    steps = {}
    for setting in own:
        alike = setting.method, setting.times
        if setting.factor == 1:
            motion = ours.run(task, setting, setting.steps, limit)
            steps[alike] = motion.steps
        elif steps.get(alike):
            motion = ours.run(task, setting, setting.factor * steps[alike], limit)
        else:
            motion = Motion(reason="no run with steps x1")
        yield setting.method, str(setting), motion
    for engine, settings in others.items():
        motions = outside(task, engine, settings, python, limit)
        for setting, motion in zip(settings, motions, strict=True):
            yield engine, ", ".join(f"{k} {value:g}" for k, value in setting.items()), motion


def outside(
    task: Task, engine: str, settings: list[dict], python: str, limit: float
) -> Iterator[Motion]:
    """The motion of every setting in turn."""
    command = [python, str(Path(__file__).with_name(ENGINES[engine])), engine]
    job = pickle.dumps((plain(task), (task.fps, task.frames, task.stop, limit), settings))
    most = 2 * (round(GRACE + limit * len(settings)),)
    bound = partial(resource.setrlimit, resource.RLIMIT_CPU, most)
    done = subprocess.run(command, input=job, capture_output=True, preexec_fn=bound)
    reason = done.stderr.decode().strip().rpartition("\n")[2] or f"exit code {done.returncode}"
    if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        reason = "too slow: the process was stopped"
    if reason.startswith("ModuleNotFoundError"):
        reason += ": pip install 'warp_contact[peers]'"
    results = io.BytesIO(done.stdout)
    for _ in settings:
        try:
            yield Motion(**pickle.load(results))
        except (EOFError, pickle.UnpicklingError):
            yield Motion(reason=reason)


def plain(task: Task) -> SimpleNamespace:
    """The scene of a task as arrays, numbered through all bodies."""
    scene = task.scene()
    sides = [b.x[b.mesh.surface] - b.x[np.roll(b.mesh.surface, 1, axis=1)] for b in scene.bodies]
    edge = min(np.linalg.norm(s, axis=2).mean(axis=1).mean() for s in sides)
    return SimpleNamespace(
        **vars(Numbered(scene)),
        x=task.start(scene),  # (n, 3) [m]
        edge=float(edge),  # mean one of the surface of the finest body [m]
        bodies=[
            SimpleNamespace(lame=b.material.lame(), tets=b.mesh.tets, **asdict(b.material))
            for b in scene.bodies
        ],
        planes=[(n.tolist(), h) for n, h in scene.planes],
        gravity=scene.gravity,
        friction=scene.friction,
        fps=task.fps,
    )


def versions(python: str) -> str:
    """What is installed under an interpreter of the engines outside."""
    done = subprocess.run([python, "-c", VERSIONS], capture_output=True, text=True)
    return ", ".join(done.stdout.splitlines())
