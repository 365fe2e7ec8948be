"""The command ``run``: a scene, by its name or its file, to frames, metrics and checkpoints.

A run lives in one folder, beside its USD: ``metrics.jsonl``, a line a frame, and
``checkpoint.npz``, from which ``--resume`` continues.
"""

import ast
import importlib
import importlib.util
import inspect
import json
import math
import os
import time
from pathlib import Path
from types import ModuleType

import numpy as np

from warp_contact import checks
from warp_contact.command.lock import RunLock
from warp_contact.command.scene_file import check_scene_file
from warp_contact.command.warned import warned
from warp_contact.errors import UsageError
from warp_contact.progress import Progress, announce
from warp_contact.scene.scene import Scene
from warp_contact.simulation import Simulation
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce
from warp_contact.usd.prims import parts
from warp_contact.usd.reader import frame_numbers, open_stage, read_points, root_path
from warp_contact.usd.writer import UsdWriter

RESPONSES = ("contact-surface", "literal", "penalty", "predicted")
SAVE_EVERY = 1.0  # least time between two checkpoints of a run, but for the last [s]


def run(args) -> int:
    """Simulate a scene."""
    module = load_scene(args.scene)
    scene = build_scene(module, args.scene, settings(module.build, args.settings))
    n = args.frames or getattr(module, "FRAMES", 120)
    announce("loading the kernels (the first run compiles them)", args.quiet)
    try:
        root = root_path(args.out)
        sim = simulation(module, scene, args)
    except ValueError as error:
        raise UsageError(str(error)) from error
    with RunLock(root):
        return write_run(sim, module, root, n, args)


def write_run(sim: Simulation, module, root: Path, n: int, args) -> int:
    """Step the simulation and write the run, or go on with an earlier one."""
    saved, metrics = root.with_name("checkpoint.npz"), root.with_name("metrics.jsonl")
    try:
        kept = go_on(sim, root, saved, metrics) if args.resume else 0
        view = getattr(module, "VIEW", None)
        view = (view["eye"], view["target"]) if view else None
        writer = UsdWriter(root, sim, flatten=args.flatten, view=view, resume=args.resume)
    except ValueError as error:
        raise UsageError(str(error)) from error
    if args.resume:
        os.truncate(metrics, kept)
    else:
        saved.unlink(missing_ok=True)
    with writer, metrics.open("a" if args.resume else "w", encoding="utf-8") as log:
        take_frames(sim, n, writer, log, saved, args)
    if not args.quiet:
        print(f"{writer.root}: frames {writer.start} to {writer.end}")
        print(metrics)
    return 0


def simulation(module, scene: Scene, args) -> Simulation:
    """The simulation that the command line asks for."""
    return Simulation(
        scene,
        response(module, args),
        fps=args.fps,
        substeps=args.substeps,
        max_substeps=args.max_substeps,
        device=args.device,
        sleeping=args.sleep,
    )


def take_frames(sim: Simulation, n: int, writer: UsdWriter, log, saved: Path, args) -> None:
    """Step to frame ``n``, write each frame, and a checkpoint now and then."""
    left = max(0, n - sim.frame)
    with Progress(left, args.quiet) as line:
        if not args.resume:
            record(sim, writer, log)
            sim.save(saved)
        last = time.monotonic()
        for frame in sim.frames(left):
            measured = record(sim, writer, log)
            line.update(sim, measured)
            if frame == n or time.monotonic() - last >= SAVE_EVERY:
                sim.save(saved)
                last = time.monotonic()


def go_on(sim, root: Path, saved: Path, metrics: Path) -> int:
    """Continue an earlier run at its checkpoint; return how much of its metrics stays [bytes].

    Raises:
        OSError: a file of the run cannot be read
        ValueError: there is no checkpoint, or it is of another scene or other settings, or the
            frames before it are not all there
    """
    if not saved.is_file():
        raise ValueError(f"nothing to resume: no file {saved}")
    x, begun = sim.positions(), line_of(sim, sim.measure())
    sim.load(saved)
    stage = open_stage(root)
    lines = metrics.read_bytes().splitlines(keepends=True)[: sim.frame + 1]
    if len(lines) <= sim.frame or sim.frame not in frame_numbers(stage):
        raise ValueError(f"{root.parent} lacks frames before that of its checkpoint")
    bodies = dict(zip(sim.model.labels, parts(sim.model), strict=True))
    points, first = read_points(stage, 0), json.loads(lines[0])
    same = list(points) == list(bodies)
    same = same and all(np.array_equal(points[k], x[body.ids]) for k, body in bodies.items())
    # These measures are sums on the host, the same for every device.
    if not same or any(begun[k] != first[k] for k in ("kinetic", "momentum", "angular_momentum")):
        raise ValueError(f"{saved} is of a run with other bodies, or placed or moved otherwise")
    return sum(map(len, lines))


def record(sim, writer: UsdWriter, log):
    """Write a frame and its line of metrics; return what was measured."""
    measured = sim.measure()
    writer.write()
    log.write(json.dumps(line_of(sim, measured), allow_nan=False) + "\n")
    log.flush()
    return measured


def line_of(sim, measured) -> dict:
    """A frame's metrics as JSON takes them; forces as [body, body, N]."""
    values = {name: plain(value) for name, value in vars(measured).items() if name != "forces"}
    forces = [[a, b, plain(force)] for (a, b), force in measured.forces.items()]
    return {"frame": sim.frame, "time": sim.time, **values, "forces": forces}


def plain(value):
    """A value as JSON takes it, null for a number that is not finite."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def load_scene(name: str) -> ModuleType:
    """The module of a scene, by its name or its file."""
    if not name.endswith(".py"):
        try:
            return importlib.import_module("warp_contact.scenes").load(name)
        except ValueError as error:
            raise UsageError(str(error)) from error
    path = Path(name)
    if not path.is_file():
        raise UsageError(f"no such file: {name}")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    try:
        with warned():
            spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise UsageError(f"{name}: {type(error).__name__}: {error}") from error
    if not callable(getattr(module, "build", None)):
        raise UsageError(f"{name} has no function build()")
    check_scene_file(module, name)
    return module


def settings(build, pairs: list[str]) -> dict:
    """The arguments of ``build`` from KEY=VALUE; a value is a Python literal or else a string."""
    parameters = inspect.signature(build).parameters.values()
    known = [p.name for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    open_ended = any(p.kind == p.VAR_KEYWORD for p in parameters)
    result = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals:
            raise UsageError(f"--set {pair}: not of the form KEY=VALUE")
        if key not in known and not open_ended:
            valid = ", ".join(known) or "none"
            raise UsageError(f"--set {key}: the scene has no such setting; it has: {valid}")
        try:
            result[key] = ast.literal_eval(value)
        except (ValueError, SyntaxError):
            result[key] = value
    return result


def build_scene(module: ModuleType, name: str, values: dict):
    """The scene; what its ``build`` raises counts as wrong input."""
    try:
        with warned():
            scene = module.build(**values)
        return checks.instance(scene, Scene, "what build() returns,", "a wc.Scene")
    except (Exception, SystemExit) as error:
        kind = "" if isinstance(error, ValueError) else f"{type(error).__name__}: "
        raise UsageError(f"scene {name}: {kind}{error}") from error


def response(module: ModuleType, args):
    """The response that was asked for; the penalty takes the scene's constants."""
    if args.response == "contact-surface":
        return ContactSurface()
    if args.response == "literal":
        return ContactSurface(search="literal")
    if args.response == "predicted":
        return PredictedForce()
    if not hasattr(module, "PENALTY"):
        raise UsageError(f"{args.scene} has no PENALTY = {{'stiffness': ..., 'damping': ...}}")
    return Penalty(**module.PENALTY)
