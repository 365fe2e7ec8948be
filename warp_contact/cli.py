"""The command line: ``warp-contact run | scenes | info | render | validate``.

Exit codes: 0 done, 1 failed on the way, 2 wrong usage or input, 130 interrupted. What goes wrong is
said in one line on stderr; ``--debug`` before the command raises it instead.
"""

import argparse
import ast
import importlib
import importlib.util
import inspect
import json
import math
import os
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import warp as wp

from warp_contact import __version__
from warp_contact.errors import SimulationError
from warp_contact.mesh import TetMesh
from warp_contact.progress import Progress
from warp_contact.render import animate, render
from warp_contact.response import ContactSurface, Penalty
from warp_contact.simulation import Simulation
from warp_contact.usd import UsdWriter, frame_numbers, open_stage, read_bodies
from warp_contact.usd_check import problems

RESPONSES = ("contact-surface", "literal", "penalty")


class UsageError(ValueError):
    """The user asked for something that cannot be."""


class Parser(argparse.ArgumentParser):
    """An argument parser that reports an error in one line."""

    def error(self, message: str):
        """Exit with code 2."""
        self.exit(2, f"{self.prog}: error: {message}\n")


def main(argv: list[str] | None = None) -> int:
    """Run a command and return its exit code."""
    try:
        args = parser().parse_args(argv)
    except SystemExit as stop:
        return int(stop.code or 0)
    try:
        start_warp()
        code = args.command(args)
        sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        return fail("interrupted", 130)
    except BrokenPipeError:  # the reader of stdout, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if args.debug:
            raise
        known = isinstance(error, (UsageError, SimulationError, OSError, ValueError, ImportError))
        text = str(error) if known else f"{type(error).__name__}: {error}"
        return fail(text, 2 if isinstance(error, UsageError) else 1)


def fail(text: str, code: int) -> int:
    """Say in one line what went wrong."""
    print(f"warp-contact: error: {' '.join(text.split())}", file=sys.stderr)
    return code


def start_warp() -> None:
    """Initialise Warp without its banner and its remark that there is no GPU."""
    wp.config.log_level = wp.LOG_WARNING
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        wp.init()
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def parser() -> argparse.ArgumentParser:
    """The arguments of all commands."""
    top = Parser(prog="warp-contact", description="Contact between deformable bodies.")
    top.add_argument("--version", action="version", version=f"warp-contact {__version__}")
    top.add_argument("--debug", action="store_true", help="show the traceback of an error")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    add_run(commands)
    command = commands.add_parser("scenes", help="list the scenes")
    command.set_defaults(command=scenes)
    command = commands.add_parser("info", help="what is in a USD file or a mesh file")
    command.add_argument("file", metavar="FILE", help="run directory, USD file or tet mesh")
    command.set_defaults(command=info)
    add_render(commands)
    command = commands.add_parser("validate", help="check a USD file")
    command.add_argument("file", metavar="DIR", help="run directory or USD file")
    command.set_defaults(command=validate)
    return top


def add_run(commands) -> None:
    """The arguments of ``run``."""
    command = commands.add_parser("run", help="simulate a scene and write USD and metrics")
    add = command.add_argument
    add("scene", metavar="SCENE", help="name of a scene, or a .py file with build()")
    add("--frames", type=count, metavar="N", help="frames to step; default: the scene's")
    add("--out", required=True, type=Path, metavar="DIR", help="directory of the results")
    add("--response", choices=RESPONSES, default=RESPONSES[0], help="default: %(default)s")
    add("--device", metavar="NAME", help="cpu, cuda:0, ...; default: Warp's")
    add("--substeps", type=count, metavar="N", help="steps a frame; default: automatic")
    add("--fps", type=positive, default=60.0, help="frames a second; default: %(default)g")
    add("--set", nargs="+", action="extend", default=[], metavar="KEY=VALUE", dest="settings")
    add("--quiet", action="store_true", help="no progress line and no summary")
    add("--flatten", action="store_true", help="also write everything into one .usdc")
    command.set_defaults(command=run)


def add_render(commands) -> None:
    """The arguments of ``render``."""
    command = commands.add_parser("render", help="draw pictures of a USD file")
    add = command.add_argument
    add("file", metavar="DIR", help="run directory or USD file")
    add("--frames", metavar="LIST", help="such as 0,30,-1 or 0:120:2; default: all")
    add("--size", type=size, default=(960, 540), metavar="WxH", help="default: 960x540")
    add("--out", type=Path, metavar="DIR", help="default: pictures/ beside the USD file")
    add("--webp", action="store_true", help="join the pictures into an animated WebP too")
    add("--gif", action="store_true", help="join the pictures into an animated GIF too")
    add("--eye", nargs=3, type=float, metavar=("X", "Y", "Z"), help="place of the camera [m]")
    add("--target", nargs=3, type=float, metavar=("X", "Y", "Z"), help="where it looks [m]")
    add("--samples", type=count, default=2, help="rays along a pixel's side; default: %(default)s")
    add("--wire", type=float, default=0.0, metavar="S", help="darken triangle edges, 0 to 1")
    add("--device", metavar="NAME", help="cpu, cuda:0, ...; default: Warp's")
    add("--quiet", action="store_true", help="do not name the files")
    command.set_defaults(command=draw)


def count(text: str) -> int:
    """A whole number above zero."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not above zero")
    return value


def positive(text: str) -> float:
    """A finite number above zero."""
    value = float(text)
    if not (math.isfinite(value) and value > 0.0):
        raise argparse.ArgumentTypeError(f"{text} is not above zero")
    return value


def size(text: str) -> tuple[int, int]:
    """Width and height of a picture."""
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal() and int(width) and int(height)):
        raise argparse.ArgumentTypeError(f"{text} is not of the form 960x540")
    return int(width), int(height)


def run(args) -> int:
    """Simulate a scene."""
    module = load_scene(args.scene)
    scene = build_scene(module, args.scene, settings(module.build, args.settings))
    n = args.frames or getattr(module, "FRAMES", 120)
    try:
        sim = Simulation(
            scene, response(module, args), fps=args.fps, substeps=args.substeps, device=args.device
        )
        view = getattr(module, "VIEW", None)
        view = (view["eye"], view["target"]) if view else None
        writer = UsdWriter(args.out, sim, flatten=args.flatten, view=view)
    except ValueError as error:
        raise UsageError(str(error)) from error
    metrics = writer.root.parent / "metrics.jsonl"
    with writer, metrics.open("w", encoding="utf-8") as log, Progress(n, args.quiet) as line:
        record(sim, writer, log)
        for _ in sim.frames(n):
            measured = record(sim, writer, log)
            line.update(sim.frame, sim.time, measured.n_contacts, measured.overlap)
    if not args.quiet:
        print(f"{writer.root}: frames {writer.start} to {writer.end}")
        print(metrics)
    return 0


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
