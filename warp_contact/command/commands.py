"""The commands except ``run``; each takes its arguments and returns an exit code."""

import importlib
import importlib.util
import signal
from pathlib import Path

import warp as wp

from warp_contact.command.warned import warned
from warp_contact.errors import UsageError
from warp_contact.picture import plot as figures
from warp_contact.picture.files import NEEDS, animate
from warp_contact.picture.render import render
from warp_contact.picture.viewer import Viewer
from warp_contact.scene.files import in_child, regular
from warp_contact.scene.mesh import TetMesh
from warp_contact.usd.check import problems
from warp_contact.usd.reader import (
    frame_numbers,
    frame_rate,
    only_root,
    open_stage,
    read_bodies,
    root_path,
    usd_errors,
)


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
    if path.is_dir() or path.suffix.lower().startswith(".usd"):
        with usd_errors(path):
            stage = readable_stage(path)
            bodies = read_bodies(stage)
            if bodies:
                return stage_info(stage, bodies)
    if path.is_dir():
        raise ValueError(f"{path} holds no bodies: it is damaged, or not of a run")
    return mesh_info(path)


def readable_stage(path: Path, frames: str = "first"):
    """The stage at a path, once another process could read it: the first frame, or ``all``.

    Raises:
        OSError: it cannot be opened
        ValueError: to read it takes for ever, or breaks down
    """
    root = path
    if path.is_dir():
        root = root_path(path) if root_path(path).exists() else only_root(path)
    beside = [root, *root.parent.glob("*.usdc"), *root.parent.glob("frames/*.usdc")]
    size = sum(file.stat().st_size for file in beside if file.is_file())
    in_child("stage", regular(root), frames, size)
    return open_stage(path)


def stage_info(stage, bodies) -> int:
    """Print the frames and bodies of a stage."""
    frames, fps = frame_numbers(stage), frame_rate(stage)
    rows = []
    for body in bodies:
        points = body.mesh.GetPointsAttr().Get(frames[0])
        faces = body.mesh.GetFaceVertexCountsAttr().Get()
        tets = body.sim.GetTetVertexIndicesAttr().Get() if body.sim else None
        vertices = body.sim.GetPointsAttr().Get() if body.sim else points
        rows.append((body, *(len(part or ()) for part in (vertices, faces, tets))))
    vertices, triangles, tets = (sum(row[k] for row in rows) for k in (1, 2, 3))
    print(f"file    {stage.GetRootLayer().realPath}")
    print(f"frames  {frames[0]} to {frames[-1]}, {fps:g} a second, {(len(frames) - 1) / fps:g} s")
    print(f"bodies  {len(rows)}: {vertices} vertices, {tets} tets, {triangles} surface triangles")
    width = max(len(body.label) for body in bodies)
    for body, vertices, triangles, tets in rows:
        kind = "  fixed" * body.fixed + "  rigid" * body.rigid
        print(f"  {body.label:{width}} {vertices:7} {tets:7} {triangles:7}{kind}")
    return 0


def mesh_info(path: Path) -> int:
    """Print the counts, volume and quality of a tet mesh."""
    with warned():
        mesh = TetMesh.load(path)
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    print(f"file     {path}")
    print(f"counts   {len(mesh.vertices)} vertices, {len(mesh.tets)} tets, ", end="")
    print(f"{len(mesh.surface)} surface triangles")
    if mesh.n_pieces > 1 or len(mesh.seams):
        print(f"pieces   {mesh.n_pieces}, {len(mesh.seams)} pairs of vertices in the same place")
    print(f"size     {' x '.join(f'{d:.6g}' for d in high - low)} m, volume {mesh.volume:.6g} m^3")
    print(f"quality  {mesh.quality.min():.3f} to {mesh.quality.max():.3f} (1: regular, 0: flat)")
    return 0


def plot(args) -> int:
    """Draw the metrics of a run."""
    path = Path(args.file)
    if not path.exists():
        raise UsageError(f"no such file: {path}")
    lines = figures.read_metrics(path)
    folder = path.resolve() if path.is_dir() else path.resolve().parent
    out = args.out or folder / "metrics.png"
    figures.plot(lines, out, args.what, folder.name)
    if not args.quiet:
        print(out)
    return 0


def draw(args) -> int:
    """Draw pictures."""
    if not Path(args.file).exists():
        raise UsageError(f"no such file: {args.file}")
    kinds = [kind for kind in NEEDS if getattr(args, kind)]
    for kind in kinds:
        if importlib.util.find_spec(NEEDS[kind][0]) is None:
            raise UsageError(NEEDS[kind][1])
    with usd_errors(args.file):
        stage = readable_stage(Path(args.file), "all")
        every = frame_numbers(stage)
        try:
            wp.get_device(args.device)
            frames = chosen_frames(args.frames, every)
        except ValueError as error:
            raise UsageError(str(error)) from error
        rate = frame_rate(stage) * len(frames) / max(1, frames[-1] - frames[0] + 1)
        root = Path(stage.GetRootLayer().realPath)
        out = args.out or root.parent / "pictures"
        names = ("samples", "wire", "cut", "device")
        looks = {name: getattr(args, name) for name in names}
        if not args.quiet:
            looks["report"] = lambda path: print(path, flush=True)
        pictures = render(stage, out, frames, args.size, args.eye, args.target, **looks)
    for kind in kinds:
        animate(pictures, out / f"{root.stem}.{kind}", rate)
        if not args.quiet:
            print(out / f"{root.stem}.{kind}")
    return 0


def view(args) -> int:
    """Show a run in a browser, until Ctrl+C."""
    if not Path(args.file).exists():
        raise UsageError(f"no such file: {args.file}")
    with usd_errors(args.file):
        readable_stage(Path(args.file), "all")
        viewer = Viewer(args.file, args.port)
        print(f"{viewer.url} (Ctrl+C ends it)", flush=True)
        try:
            viewer.run()
        except KeyboardInterrupt as stop:
            if getattr(stop, "number", signal.SIGINT) != signal.SIGINT:
                raise
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
            found = [frame for frame in every[:: 1 if numbers.step > 0 else -1] if frame in numbers]
        if not found:
            raise ValueError(f"no frame {item}: the file has {every[0]} to {every[-1]}")
        frames += found
    return frames


def validate(args) -> int:
    """Check a file and print what is wrong with it."""
    if not Path(args.file).exists():
        raise UsageError(f"no such file: {args.file}")
    try:
        readable_stage(Path(args.file), "all")
        found = problems(args.file)
    except (OSError, ValueError) as error:
        found = [str(error)]
    for line in found:
        print(line)
    if not found:
        frames = frame_numbers(open_stage(args.file))
        print(f"ok: frames {frames[0]} to {frames[-1]}")
    return 1 if found else 0
