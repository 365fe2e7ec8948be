"""The command ``run``: a scene, by its name or its file, to frames, metrics and checkpoints.

A run lives in one folder, beside its USD: ``metrics.jsonl``, a line a frame, and
``checkpoint.npz``, from which ``--resume`` continues.
"""

import ast
import importlib
import importlib.util
import inspect
import json
import time
from pathlib import Path
from types import ModuleType

import numpy as np

from warp_contact import checks, interrupts
from warp_contact.command.metrics import figures, line_of
from warp_contact.command.scene_file import check_scene_file
from warp_contact.command.warned import warned
from warp_contact.errors import UsageError
from warp_contact.files import append, replacing
from warp_contact.progress import Progress, announce
from warp_contact.scene.scene import Scene
from warp_contact.simulation import Simulation
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce, VirtualSurface
from warp_contact.usd.folder import RunFolder, frame_file
from warp_contact.usd.kept import check_frames, read_layer
from warp_contact.usd.motion import motion, motion_types, numbers
from warp_contact.usd.prims import parts
from warp_contact.usd.writer import UsdWriter

RESPONSES = ("contact-surface", "literal", "penalty", "virtual", "predicted")
METRICS, CHECKPOINT = "metrics.jsonl", "checkpoint.npz"
SAVE_EVERY = 1.0  # least time between two checkpoints of a run, but for the last [s]


def run(args) -> int:
    """Simulate a scene."""
    module = load_scene(args.scene)
    scene = build_scene(module, args.scene, settings(module.build, args.settings))
    n = args.frames or getattr(module, "FRAMES", 120)
    try:
        folder = RunFolder(args.out, args.overwrite, args.resume, beside=(METRICS, CHECKPOINT))
    except (ValueError, OSError) as error:
        raise UsageError(str(error)) from error
    with folder:
        announce("loading the kernels (the first run compiles them)", args.quiet)
        try:
            sim = simulation(module, scene, args)
        except ValueError as error:
            raise UsageError(str(error)) from error
        announce(sim.summary(), args.quiet)
        return write_run(sim, module, folder, n, args)


def write_run(sim: Simulation, module, folder: RunFolder, n: int, args) -> int:
    """Step the simulation and write the run, or go on with an earlier one."""
    view = getattr(module, "VIEW", None)
    view = (view["eye"], view["target"]) if view else None
    options = {"flatten": args.flatten, "view": view, "resume": args.resume}
    if args.resume:
        try:
            go_on(sim, folder.root)
            writer = UsdWriter(folder, sim, **options)
        except (ValueError, OSError) as error:
            remedy = "to start anew, give --overwrite instead of --resume"
            raise UsageError(f"{error}; {remedy}") from error
        with replacing(folder.now / METRICS) as part:
            part.write_text("".join(writer.notes), encoding="utf-8")
    else:
        writer = UsdWriter(folder, sim, **options)
    with writer:
        try:
            take_frames(sim, n, writer, args)
        except KeyboardInterrupt as stop:
            if (folder.now / CHECKPOINT).is_file():
                stop.add_note(f"--resume goes on from frame {sim.frame} or shortly before")
            raise
    if not args.quiet:
        print(f"{writer.root}: frames {writer.start} to {writer.end}")
        print(folder.now / METRICS)
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
        integrator=args.integrator,
    )


def take_frames(sim: Simulation, n: int, writer: UsdWriter, args) -> None:
    """Step to frame ``n``, write each frame, and a checkpoint now and then."""
    folder, left = writer.folder, max(0, n - sim.frame)
    with Progress(left, args.quiet) as line:
        if left:
            line.expect(sim.next_substeps())
        if not args.resume:  # all of it appears together, over another run not before frame 1
            text = line_of(sim, sim.measure())
            append(folder.now / METRICS, text, wait=False)
            folder.wrote(folder.now / METRICS)
            sim.save(folder.now / CHECKPOINT)
            writer.write(text, publish=not folder.replaces)
        last = time.monotonic()
        for frame in sim.frames(left):
            measured = sim.measure()
            text = line_of(sim, measured)
            writer.write(text)
            append(folder.now / METRICS, text, wait=False)
            folder.wrote(folder.now / METRICS)
            line.update(sim, measured)
            interrupts.check()
            if frame == n or time.monotonic() - last >= SAVE_EVERY:
                writer.sync()  # what the checkpoint counts on
                sim.save(folder.now / CHECKPOINT)
                last = time.monotonic()


def go_on(sim: Simulation, root: Path) -> None:
    """Continue an earlier run at its checkpoint.

    Raises:
        OSError: a file of the run cannot be read
        ValueError: there is no checkpoint, or it is of another scene or other settings, or the
            first frame is not that of this run
    """
    saved = root.with_name(CHECKPOINT)
    if not saved.is_file():
        raise ValueError(f"nothing to resume: no file {saved}")
    x, begun = sim.positions(), figures(sim.measure())
    wanted: dict[str, np.ndarray] = {}
    for part in parts(sim.model):
        wanted |= zip(motion_types(part), map(numbers, motion(part, sim, x)), strict=True)
    sim.load(saved)
    first = read_layer(frame_file(root.parent, 0))
    same = first is None or all(first.GetAttributeAtPath(name) for name in wanted)
    if same:
        lengths = {name: len(values) for name, values in wanted.items()}
        (data,) = check_frames(root.parent, range(1), lengths)
        line = json.loads(data.get("note") or "{}")
        same = all(_agree(numbers(first.QueryTimeSample(k, 0.0)), v) for k, v in wanted.items())
        # These measures are sums on the host, the same for every device.
        sums = ("kinetic", "momentum", "angular_momentum")
        same = same and all(line.get(name) == begun[name] for name in sums)
    if not same:
        raise ValueError(f"{saved} is of a run with other bodies, or placed or moved otherwise")


def _agree(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether values are the same; other versions of NumPy may round a pose otherwise."""
    return np.allclose(a, b, rtol=0.0, atol=1e-9 if b.dtype == np.float64 else 0.0)


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
    """The response that was asked for; penalties take the scene's constants."""
    if args.response == "contact-surface":
        return ContactSurface()
    if args.response == "literal":
        return ContactSurface(search="literal")
    if args.response == "predicted":
        return PredictedForce()
    if not hasattr(module, "PENALTY"):
        raise UsageError(f"{args.scene} has no PENALTY = {{'stiffness': ..., 'damping': ...}}")
    kind = VirtualSurface if args.response == "virtual" else Penalty
    return kind(**module.PENALTY)
