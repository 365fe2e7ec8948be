"""Random scenes of 1e-6 to 1e4 m, 1 to 1e12 Pa and any density: run, or told the true reason?

python tests/trials/fuzz_scenes.py 2000 1            # scenes, seed
python tests/trials/fuzz_scenes.py 2000 1 implicit   # implicit steps, a quarter of the bodies rigid

A fault is a crash, a traceback, a scene that takes longer than it may, a state that is not finite,
a tet called flat that is not, momentum that changes in free flight, or energy from nowhere. Scenes
that need more steps than are taken here end with that reason. The exit code is 1 after a fault.
"""

import json
import select
import subprocess
import sys
import traceback
import warnings
from collections import Counter

import numpy as np
import warp as wp

import warp_contact as wc

SECONDS = 60.0  # a scene, on a busy machine; most take less than one
MOST = 1000  # steps in a frame
NEEDLE = 0.05  # quality of a tet that may be called flat
NONE = 0.0, 0.0, 0.0


def mesh_of(rng, size: float) -> wc.TetMesh:
    """A box, a ball, a cylinder or a tet, longer in one direction than in another."""
    stretch = 10.0 ** rng.uniform(-0.5, 0.0, 3)
    kind = rng.integers(4)
    if kind == 0:
        return wc.sphere(0.5 * size, 41).scaled(*stretch)
    if kind == 1:
        return wc.cylinder(0.5 * size, size, 1).scaled(*stretch)
    if kind == 2:
        return wc.TetMesh(size * stretch * rng.normal(size=(4, 3)), [[0, 1, 2, 3]])
    return wc.box(size, int(rng.integers(1, 4))).scaled(*stretch)


def scene_of(seed: int, rigid: float) -> tuple[wc.Scene, float]:
    """A scene and its frames a second, in proportion to the time that a wave takes.

    A part ``rigid`` of the bodies is so.
    """
    rng = np.random.default_rng(seed)
    size, young, density = (10.0 ** rng.uniform(*ends) for ends in ((-6, 4), (0, 12), (-1, 4.3)))
    speed = np.sqrt(young / density)
    weight = rng.random() < 0.5
    gravity = 0.01 * young / (density * size) * rng.normal(size=3) if weight else NONE
    scene = wc.Scene(np.clip(gravity, -1e4, 1e4), friction=float(rng.choice([0.0, 0.3, 1.0])))
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    for k in range(rng.integers(1, 4)):
        law = rng.choice([wc.NeoHookean, wc.Corotated])
        damping = float(rng.choice([0.0, 0.1])) * size / speed
        material = law(young, float(rng.choice([0.0, 0.3, 0.49])), density, damping)
        if rigid and rng.random() < rigid:
            material = wc.Rigid(density)
        place = k * rng.uniform(0.7, 2.0) * size * way
        moving = min(0.05 * speed, 1e4) * (rng.random() < 0.5)
        scene.add_body(mesh_of(rng, size), material, place, rng.normal(size=4), -k * moving * way)
    return scene, float(np.clip(speed / size, 1.0, 1e12))


def look(seed: int, integrator: str) -> tuple[str, str]:
    """What comes of a scene; capitals for a fault."""
    try:
        scene, fps = scene_of(seed, 0.25 * (integrator == "implicit"))
        sim = wc.Simulation(scene, fps=fps, max_substeps=MOST, integrator=integrator)
    except ValueError as error:
        flat = "too flat" in str(error) and quality(scene) > NEEDLE
        return "FALSE REASON" if flat else "refused", str(error)
    start, free = sim.measure(), not np.any(scene.gravity)
    most, flight = start.energy, True
    try:
        for _ in sim.frames(5):
            now = sim.measure()
            most, flight = max(most, now.energy), flight and not now.n_contacts
    except wc.SimulationError as error:
        flat = "too flat" in str(error) and quality(scene) > NEEDLE
        return "FALSE REASON" if flat else "ended", str(error)
    if not np.isfinite([now.energy, *sim.positions().ravel(), *sim.velocities().ravel()]).all():
        return "NOT FINITE", ""
    mass = sim.model.mass.numpy().astype(float)
    scale = (mass * np.linalg.norm(sim.velocities(), axis=1)).sum()
    if free and np.linalg.norm(now.momentum - start.momentum) > 1e-4 * scale + 1e-12 * mass.sum():
        return "MOMENTUM", f"{now.momentum - start.momentum} of {scale:.3g}"
    soft = [b for b in scene.bodies if not isinstance(b.material, wc.Rigid)]
    stored = sum(b.mesh.volume * b.material.youngs_modulus for b in soft)
    if not soft:  # nothing to compare rounding with
        return "ran", ""
    if start.overlap == 0.0 and most - start.energy > 0.02 * abs(start.kinetic) + 1e-6 * stored:
        return "ENERGY", f"{start.energy:.4g} to {most:.4g} J"
    return "ran", ""


def quality(scene: wc.Scene) -> float:
    """Of the flattest tet."""
    return min(float(body.mesh.quality.min()) for body in scene.bodies)


def work(integrator: str) -> None:
    """Answer the seeds that come line by line."""
    wp.config.log_level = wp.LOG_WARNING
    warnings.simplefilter("ignore")
    for line in sys.stdin:
        try:
            answer = look(int(line), integrator)
        except Exception:
            answer = "TRACEBACK", traceback.format_exc()[-600:]
        print("=", json.dumps(answer), flush=True)


def main(n: int, seed: int, integrator: str) -> int:
    """Try the scenes, name those with faults, count what came."""
    command = [sys.executable, __file__, "--work", integrator]
    given = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    worker, count = subprocess.Popen(command, **given), Counter()
    for k in range(1_000_000 * seed, 1_000_000 * seed + n):
        print(k, file=worker.stdin, flush=True)
        line = ""
        while not line.startswith("="):
            ready = select.select([worker.stdout], [], [], SECONDS)[0]
            line = worker.stdout.readline() if ready else ""
            if not line:
                worker.kill()
                line = "= " + json.dumps(("CRASH" if ready else "HANG", str(worker.wait())))
                worker = subprocess.Popen(command, **given)
        kind, said = json.loads(line[2:])
        count[kind] += 1
        if kind.isupper():
            print(f"{kind}: scene {k}: {said}", flush=True)
    print(", ".join(f"{number} {kind}" for kind, number in sorted(count.items())))
    return int(any(kind.isupper() for kind in count))


if __name__ == "__main__":
    if sys.argv[1] == "--work":
        work(sys.argv[2])
    else:
        sys.exit(main(int(sys.argv[1]), int(sys.argv[2]), *(sys.argv[3:] or ["explicit"])))
