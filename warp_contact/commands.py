"""The commands of the command line: each takes its parsed arguments and returns an exit code."""

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
import warp as wp

from warp_contact.errors import UsageError
from warp_contact.mesh import TetMesh
from warp_contact.pictures import animate
from warp_contact.progress import Progress, announce
from warp_contact.render import render
from warp_contact.response import ContactSurface, Penalty, PredictedForce
from warp_contact.simulation import Simulation
from warp_contact.usd import (
    UsdWriter,
    frame_numbers,
    open_stage,
    read_bodies,
    read_points,
    root_path,
)
from warp_contact.usd_check import problems
from warp_contact.usd_scene import parts

RESPONSES = ("contact-surface", "literal", "penalty", "predicted")
SAVE_EVERY = 1.0  # least time between two checkpoints of a run, but for the last [s]


def run(args) -> int:
    """Simulate a scene."""
    module = load_scene(args.scene)
    scene = build_scene(module, args.scene, settings(module.build, args.settings))
    n = args.frames or getattr(module, "FRAMES", 120)
    announce("loading the kernels (the first run compiles them)", args.quiet)
    try:
        sim = Simulation(
            scene,
            response(module, args),
            fps=args.fps,
            substeps=args.substeps,
            device=args.device,
            sleeping=args.sleep,
        )
        view = getattr(module, "VIEW", None)
        view = (view["eye"], view["target"]) if view else None
        root = root_path(args.out)
        saved, metrics = root.with_name("checkpoint.npz"), root.with_name("metrics.jsonl")
        kept = go_on(sim, root, saved, metrics) if args.resume else 0
        writer = UsdWriter(root, sim, flatten=args.flatten, view=view, resume=args.resume)
    except ValueError as error:
        raise UsageError(str(error)) from error
    if args.resume:
        os.truncate(metrics, kept)
    else:
        saved.unlink(missing_ok=True)
    left = max(0, n - sim.frame)
    with (
        writer,
        metrics.open("a" if args.resume else "w", encoding="utf-8") as log,
        Progress(left, args.quiet) as line,
    ):
        if not args.resume:
            record(sim, writer, log)
            sim.save(saved)
        last = time.monotonic()
        for frame in sim.frames(left):
            measured = record(sim, writer, log)
            line.update(frame, sim.time, measured.n_contacts, measured.overlap)
            if frame == n or time.monotonic() - last >= SAVE_EVERY:
                sim.save(saved)
                last = time.monotonic()
    if not args.quiet:
        print(f"{writer.root}: frames {writer.start} to {writer.end}")
        print(metrics)
    return 0


def go_on(sim, root: Path, saved: Path, metrics: Path) -> int:
    """Take an earlier run up at its checkpoint; return how much of the metrics it keeps [bytes].

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
    # Of what is measured, these are sums on the host, the same for every device.
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
        spec.loader.exec_module(module)
    except Exception as error:
        raise UsageError(f"{name}: {type(error).__name__}: {error}") from error
    if not callable(getattr(module, "build", None)):
        raise UsageError(f"{name} has no function build()")
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
        return module.build(**values)
    except Exception as error:
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


def scenes(args) -> int:
    """List the scenes."""
    package = importlib.import_module("warp_contact.scenes")
    names = package.names()
    width = max(map(len, names), default=0)
    for name in names:
        first = (package.load(name).__doc__ or "").strip().partition("\n")[0]
        print(f"{name:{width}}  {first}".rstrip())
    return 0


def info(args) -> int:
    """Say what is in a file."""
    path = Path(args.file)
    if not path.exists():
        raise UsageError(f"no such file: {path}")
    if path.is_dir() or path.suffix.startswith(".usd"):
        stage = open_stage(path)
        bodies = read_bodies(stage) if stage.GetDefaultPrim() else []
        if bodies:
            return stage_info(stage, bodies)
    return mesh_info(path)


def stage_info(stage, bodies) -> int:
    """Print the frames and bodies of a stage."""
    frames, fps = frame_numbers(stage), stage.GetTimeCodesPerSecond()
    rows = []
    for body in bodies:
        points, faces = (
            body.mesh.GetPointsAttr().Get(frames[0]),
            body.mesh.GetFaceVertexCountsAttr(),
        )
        tets = len(body.sim.GetTetVertexIndicesAttr().Get()) if body.sim else 0
        vertices = len(body.sim.GetPointsAttr().Get()) if body.sim else len(points)
        rows.append((body, vertices, len(faces.Get()), tets))
    vertices, triangles, tets = (sum(row[k] for row in rows) for k in (1, 2, 3))
    print(f"file    {stage.GetRootLayer().realPath}")
    print(f"frames  {frames[0]} to {frames[-1]}, {fps:g} a second, {(len(frames) - 1) / fps:g} s")
    print(f"bodies  {len(rows)}: {vertices} vertices, {tets} tets, {triangles} surface triangles")
    width = max(len(body.label) for body in bodies)
    for body, vertices, triangles, tets in rows:
        fixed = "  fixed" if body.fixed else ""
        print(f"  {body.label:{width}} {vertices:7} {tets:7} {triangles:7}{fixed}")
    return 0


def mesh_info(path: Path) -> int:
    """Print the counts, volume and quality of a tet mesh."""
    mesh = TetMesh.load(path)
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    print(f"file     {path}")
    print(f"counts   {len(mesh.vertices)} vertices, {len(mesh.tets)} tets, ", end="")
    print(f"{len(mesh.surface)} surface triangles")
    print(f"size     {' x '.join(f'{d:.6g}' for d in high - low)} m, volume {mesh.volume:.6g} m^3")
    print(f"quality  {mesh.quality.min():.3f} to {mesh.quality.max():.3f} (1: regular, 0: flat)")
    return 0


def draw(args) -> int:
    """Draw pictures."""
    if not Path(args.file).exists():
        raise UsageError(f"no such file: {args.file}")
    stage = open_stage(args.file)
    try:
        wp.get_device(args.device)
        frames = chosen_frames(args.frames, frame_numbers(stage))
    except ValueError as error:
        raise UsageError(str(error)) from error
    kinds = [kind for kind in ("webp", "gif") if getattr(args, kind)]
    if kinds and importlib.util.find_spec("PIL") is None:
        raise UsageError("animations need Pillow: pip install 'warp_contact[render]'")
    root = Path(stage.GetRootLayer().realPath)
    out = args.out or root.parent / "pictures"
    looks = {"samples": args.samples, "wire": args.wire, "device": args.device}
    if not args.quiet:
        looks["report"] = lambda path: print(path, flush=True)
    pictures = render(stage, out, frames, args.size, args.eye, args.target, **looks)
    for kind in kinds:
        rate = stage.GetTimeCodesPerSecond() * len(frames) / max(1, frames[-1] - frames[0] + 1)
        animate(pictures, out / f"{root.stem}.{kind}", rate)
        if not args.quiet:
            print(out / f"{root.stem}.{kind}")
    return 0


def chosen_frames(text: str | None, every: range) -> list[int]:
    """Frames from numbers and slices, such as ``0,30,-1`` or ``0:120:2``; -1 is the last."""
    if text is None:
        return list(every)
    end, frames = every[-1] + 1, []
    for item in text.split(","):
        try:
            parts = [int(part) if part else None for part in item.split(":")]
        except ValueError:
            parts = []
        if parts in ([], [None]) or len(parts) > 3 or parts[2:] == [0]:
            raise ValueError(f"--frames {text}: {item!r} is neither a number nor first:end:step")
        ends = [end + part if part is not None and part < 0 else part for part in parts[:2]]
        if len(parts) == 1:
            found = [frame for frame in ends if frame in every]
        else:
            first = every[0] if ends[0] is None else ends[0]
            last = end if ends[1] is None else ends[1]
            numbers = range(first, last, *filter(None, parts[2:]))
            found = [frame for frame in numbers if frame in every]
        if not found:
            raise ValueError(f"no frame {item}: the file has {every[0]} to {every[-1]}")
        frames += found
    return frames


def validate(args) -> int:
    """Check a file and print what is wrong with it."""
    if not Path(args.file).exists():
        raise UsageError(f"no such file: {args.file}")
    found = problems(args.file)
    for line in found:
        print(line)
    if not found:
        frames = frame_numbers(open_stage(args.file))
        print(f"ok: frames {frames[0]} to {frames[-1]}")
    return 1 if found else 0
