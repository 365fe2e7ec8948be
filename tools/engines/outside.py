"""Run a task in an engine outside: hand over plain arrays, read back positions.

The adapter, a file beside this one, runs in a process of its own, under an interpreter that may
have other packages. One process takes all settings of a task; each result is a file of its own, so
that a process which dies takes none with it.
"""

import json
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from engines.task import Failed, Motion, Numbered, Task

ADAPTERS = {  # of each engine: its file, a word for it, and its law of elasticity
    "Newton VBD": ("newton_solvers.py", "vbd", "neo-hookean"),
    "Newton XPBD": ("newton_solvers.py", "xpbd", "neo-hookean"),
    "MuJoCo flex": ("mujoco_flex.py", "", "st-venant"),
}
GRACE = 300.0  # seconds for imports and kernels, on top of the limits of the runs
PACKAGES = "newton", "mujoco", "warp-lang"


def run(
    task: Task, engine: str, settings: list[dict], python: str, limit: float
) -> Iterator[Motion | Failed]:
    """The motion of every setting in turn, or why there is none.

    Args:
        task: what to run
        engine: one of ``ADAPTERS``
        settings: of the engine, as the adapter reads them
        python: interpreter that has the engine
        limit: wall seconds after which one run is given up
    """
    adapter, word, law = ADAPTERS[engine]
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder)
        write(job, task, settings, limit)
        command = [python, str(Path(__file__).with_name(adapter)), folder, word]
        timeout = GRACE + limit * len(settings)
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, cwd=folder, timeout=timeout
            )
            said = [line for line in done.stderr.splitlines() if line.strip()]
            reason = said[-1].strip() if said else f"exit code {done.returncode}"
        except subprocess.TimeoutExpired:
            reason = "too slow: the process was stopped"
        except OSError as error:
            reason = str(error)
        for k in range(len(settings)):
            yield _read(job / f"result{k}.npz", law, reason)


def write(folder: Path, task: Task, settings: list[dict], limit: float) -> None:
    """The scene as arrays, numbered through all bodies, and what to do with it."""
    scene = task.scene()
    bodies, whole = scene.bodies, Numbered(scene)
    parts = zip(bodies, whole.parts, strict=True)
    materials = [body.material for body in bodies]
    np.savez(
        folder / "scene.npz",
        rest=whole.rest,
        x=task.placed(scene),
        v=np.concatenate([body.v for body in bodies]),
        fixed=np.concatenate([body.fixed for body in bodies]),
        tets=whole.tets,
        surface=np.concatenate([b.mesh.surface + p.start for b, p in parts]),
        mass=whole.mass,
        body=np.repeat(np.arange(len(bodies)), [len(body.x) for body in bodies]),
        tet_body=np.repeat(np.arange(len(bodies)), [len(body.mesh.tets) for body in bodies]),
        lame=np.array([material.lame() for material in materials]),
        young=np.array([material.youngs_modulus for material in materials]),
        poisson=np.array([material.poisson_ratio for material in materials]),
        density=np.array([material.density for material in materials]),
        damping=np.array([material.damping for material in materials]),
        planes=np.array([[*n, h] for n, h in scene.planes]).reshape(-1, 4),
        gravity=np.array(scene.gravity),
    )
    run = {"fps": task.fps, "frames": task.frames, "stop": task.stop, "limit": limit}
    job = {"friction": scene.friction, "fps": task.fps, "run": run, "settings": settings}
    (folder / "job.json").write_text(json.dumps(job), encoding="utf-8")


def versions(python: str) -> str:
    """What is installed under an interpreter of the engines outside."""
    code = (
        "from importlib import metadata as m\n"
        f"for p in {PACKAGES}:\n"
        " try: print(p, m.version(p))\n"
        " except m.PackageNotFoundError: print(p, 'not installed')"
    )
    done = subprocess.run([python, "-c", code], capture_output=True, text=True)
    return ", ".join(done.stdout.splitlines()) or f"no interpreter ({python})"


def _read(path: Path, law: str, reason: str) -> Motion | Failed:
    if not path.exists():
        return Failed(reason)
    with np.load(path) as r:
        if str(r["reason"]):
            return Failed(str(r["reason"]), float(r["wall"]) or None if "wall" in r else None)
        return Motion(r["x"], r["v"], law, float(r["wall"]), float(r["startup"]), int(r["steps"]))
