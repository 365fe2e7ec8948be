"""The command line: ``warp-contact run | scenes | info | plot | render | view | validate``.

Exit codes: 0 done, 1 failed on the way, 2 wrong usage or input, 128 + its number after a signal
(130 interrupted, 143 terminated, 129 hung up). An error is one line on stderr; ``--debug`` before
the command raises it instead.
"""

import argparse
import contextlib
import math
import os
import signal
import sys
from pathlib import Path

import warp as wp

from warp_contact import __version__, interrupts
from warp_contact.command import commands, run
from warp_contact.errors import SimulationError, UsageError
from warp_contact.picture.plot import PANELS
from warp_contact.simulation import INTEGRATORS
from warp_contact.usd.threads import one_thread


class Parser(argparse.ArgumentParser):
    """An argument parser that reports an error in one line."""

    def error(self, message: str):
        """Exit with code 2."""
        self.exit(2, f"{self.prog}: error: {message}\n")


def main(argv: list[str] | None = None) -> int:
    """Run a command and return its exit code; without ``argv`` that of this process."""
    if argv is None:  # nobody has worked with USD in it
        one_thread()
    try:
        args = parser().parse_args(argv)
    except SystemExit as stop:
        return int(stop.code or 0)
    try:
        with interrupts.Raised():
            start_warp()
            code = args.command(args)
            sys.stdout.flush()
            return code
    except KeyboardInterrupt as stop:
        said = "; ".join(["interrupted", *getattr(stop, "__notes__", ())])
        return fail(said, 128 + getattr(stop, "number", signal.SIGINT))
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
    with contextlib.suppress(OSError):  # a terminal that is gone
        print(f"warp-contact: error: {' '.join(text.split())}", file=sys.stderr, flush=True)
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
    group = top.add_subparsers(required=True, metavar="COMMAND")
    add_run(group)
    command = group.add_parser("scenes", help="list the scenes")
    command.set_defaults(command=commands.scenes)
    command = group.add_parser("info", help="what is in a USD file or a mesh file")
    command.add_argument("file", metavar="FILE", help="run directory, USD file or tet mesh")
    command.set_defaults(command=commands.info)
    add_plot(group)
    add_render(group)
    command = group.add_parser("view", help="show a run in a browser, also while it is at work")
    command.add_argument("file", metavar="DIR", help="run directory or USD file")
    port = "of the server on this machine, or the next free one; default: %(default)s"
    command.add_argument("--port", type=count, default=8080, metavar="N", help=port)
    command.set_defaults(command=commands.view)
    command = group.add_parser("validate", help="check a USD file")
    command.add_argument("file", metavar="DIR", help="run directory or USD file")
    command.set_defaults(command=commands.validate)
    return top


def add_run(group) -> None:
    """The arguments of ``run``."""
    command = group.add_parser("run", help="simulate a scene and write USD and metrics")
    add = command.add_argument
    add("scene", metavar="SCENE", help="name of a scene, or a .py file with build()")
    add("--frames", type=count, metavar="N", help="frames to step; default: the scene's")
    add("--out", required=True, type=place, metavar="DIR", help="directory of the results")
    add(
        "--response",
        choices=run.RESPONSES,
        default=run.RESPONSES[0],
        help="default: %(default)s",
    )
    add("--device", metavar="NAME", help="cpu, cuda:0, ...; default: Warp's")
    add("--substeps", type=count, metavar="N", help="steps a frame; default: automatic")
    limit = "end the run where a frame needs more steps (50000)"
    add("--max-substeps", type=count, metavar="N", default=50_000, help=limit)
    add("--fps", type=positive, default=60.0, help="frames a second; default: %(default)g")
    add(
        "--set",
        nargs="+",
        action="extend",
        default=[],
        metavar="KEY=VALUE",
        dest="settings",
        help="arguments of the scene's build(): a Python literal or else a string",
    )
    add(
        "--integrator",
        choices=INTEGRATORS,
        default="explicit",
        help="steps; default: %(default)s",
    )
    add("--sleep", action="store_true", help="leave bodies at rest alone until something comes")
    old = command.add_mutually_exclusive_group().add_argument
    old("--resume", action="store_true", help="go on from DIR/checkpoint.npz, up to frame N")
    old("--overwrite", action="store_true", help="replace what is in DIR, at the first frame")
    add("--quiet", action="store_true", help="no progress line and no summary")
    add("--flatten", action="store_true", help="also write everything into one .usdc")
    command.set_defaults(command=run.run)


def add_plot(group) -> None:
    """The arguments of ``plot``."""
    command = group.add_parser("plot", help="draw the metrics of a run over time")
    add = command.add_argument
    add("file", metavar="DIR", help="run directory, or a metrics.jsonl")
    add("--what", nargs="+", choices=PANELS, default=list(PANELS), help="panels; default: all")
    add("--out", type=place, metavar="FILE", help="default: metrics.png in DIR; also .svg, .pdf")
    add("--quiet", action="store_true", help="do not name the file")
    command.set_defaults(command=commands.plot)


def add_render(group) -> None:
    """The arguments of ``render``."""
    command = group.add_parser("render", help="draw pictures of a USD file")
    add = command.add_argument
    add("file", metavar="DIR", help="run directory or USD file")
    add("--frames", metavar="LIST", help="such as 0,30,-1 or 0:120:2; default: all")
    add("--size", type=size, default=(960, 540), metavar="WxH", help="default: 960x540")
    add("--out", type=place, metavar="DIR", help="default: pictures/ beside the USD file")
    add("--webp", action="store_true", help="join the pictures into an animated WebP too")
    add("--gif", action="store_true", help="join the pictures into an animated GIF too")
    add("--mp4", action="store_true", help="join the pictures into an MP4 too")
    add("--eye", nargs=3, type=float, metavar=("X", "Y", "Z"), help="place of the camera [m]")
    add("--target", nargs=3, type=float, metavar=("X", "Y", "Z"), help="where it looks [m]")
    add("--samples", type=count, default=2, help="rays along a pixel's side; default: %(default)s")
    add("--wire", type=float, default=0.0, metavar="S", help="darken triangle edges, 0 to 1")
    cut = "draw nothing of bodies where (NX, NY, NZ) . x > D"
    add("--cut", nargs=4, type=float, metavar=("NX", "NY", "NZ", "D"), help=cut)
    add("--device", metavar="NAME", help="cpu, cuda:0, ...; default: Warp's")
    add("--quiet", action="store_true", help="do not name the files")
    command.set_defaults(command=commands.draw)


def place(text: str) -> Path:
    """A path that is not empty."""
    if not text:
        raise argparse.ArgumentTypeError("the path is empty")
    return Path(text)


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
