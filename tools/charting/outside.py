"""Run a panel in an engine outside: hand over plain arrays, read back positions.

The adapter in ``tools/peers`` runs in a process of its own, under an interpreter that may have
other packages. One process takes all settings of a panel; each result is a file of its own, so
that a process which dies takes none with it.
"""

import json
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from charting import panel as parts
from charting.panel import Failed, Motion, Panel

PEERS = Path(__file__).resolve().parent.parent / "peers"
LAWS = {"newton_vbd.py": "neo-hookean", "newton_xpbd.py": "neo-hookean"}
GRACE = 300.0  # seconds for imports and kernels, on top of the limits of the runs


def run(
    panel: Panel, adapter: str, settings: list[dict], python: str, limit: float
) -> Iterator[Motion | Failed]:
    """The motion of every setting in turn, or why there is none.

    Args:
        panel: what to run
        adapter: a file in ``tools/peers``
        settings: of the engine, as the adapter reads them
        python: interpreter that has the engine
        limit: wall seconds after which one run is given up
    """
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder)
        write(job, panel, settings, limit)
        command = [python, str(PEERS / adapter), folder]
        try:
            done = subprocess.run(
                command,
                capture_output=True,
                text=True,
                cwd=folder,
                timeout=GRACE + limit * len(settings),
            )
            reason = _last_line(done.stderr) or f"exit code {done.returncode}"
        except subprocess.TimeoutExpired:
            reason = "too slow: the process was stopped"
        except OSError as error:
            reason = str(error)
        for k in range(len(settings)):
            yield _read(job / f"result{k}.npz", LAWS.get(adapter, "st-venant"), reason)


def write(folder: Path, panel: Panel, settings: list[dict], limit: float) -> None:
    """The scene as arrays, numbered through all bodies, and what to do with it."""
    scene = panel.scene()
    bodies = scene.bodies
    counts = [len(body.x) for body in bodies]
    surface = [b.mesh.surface + parts.part(scene, b.index).start for b in bodies]
    np.savez(
        folder / "scene.npz",
        rest=parts.rest(scene),
        x=parts.placed(panel, scene),
        v=np.concatenate([body.v for body in bodies]),
        fixed=np.concatenate([body.fixed for body in bodies]),
        tets=parts.tets(scene),
        surface=np.concatenate(surface),
        mass=parts.masses(scene),
        body=np.repeat(np.arange(len(bodies)), counts),
        tet_body=np.repeat(np.arange(len(bodies)), [len(b.mesh.tets) for b in bodies]),
        lame=np.array([body.material.lame() for body in bodies]),
        young=np.array([body.material.youngs_modulus for body in bodies]),
        poisson=np.array([body.material.poisson_ratio for body in bodies]),
        density=np.array([body.material.density for body in bodies]),
        damping=np.array([body.material.damping for body in bodies]),
        planes=np.array([[*n, h] for n, h in scene.planes]).reshape(-1, 4),
        gravity=np.array(scene.gravity),
    )
    job = {
        "friction": scene.friction,
        "fps": panel.fps,
        "frames": panel.frames,
        "stop": panel.stop,
        "limit": limit,
        "settings": settings,
    }
    (folder / "job.json").write_text(json.dumps(job), encoding="utf-8")


def _read(path: Path, law: str, reason: str) -> Motion | Failed:
    if not path.exists():
        return Failed(reason)
    with np.load(path) as r:
        if str(r["reason"]):
            return Failed(str(r["reason"]), float(r["wall"]) or None if "wall" in r else None)
        return Motion(r["x"], r["v"], law, float(r["wall"]), float(r["startup"]), int(r["steps"]))


def _last_line(text: str) -> str:
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1].strip() if lines else ""
