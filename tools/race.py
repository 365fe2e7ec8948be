"""Scenes of many contacts side by side with engines outside: time, overlap, inverted tets.

    python tools/race.py [scene ...] [--quick] [--out FILE] [--python PATH]

Every engine gets the same vertices, tets, masses and coefficient of damping and is judged from its
positions, as in ``tools/pareto.py``; each runs once, so that no time is better than the machine is
quiet. Nothing is swept: the settings are a fast and a plain one of each engine, in large scenes the
fast one.

    s / s       wall seconds per simulated second, compiling and the first frame left out
    overlap     deepest one after any frame, in edges of the finer body
    at the end  the same after the last frame
    inverted    tets that are inside out after the last frame
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import warp as wp
from charting import methods, ours, outside
from charting.panel import Failed, Motion, Panel
from pareto import cpu, versions
from verification.scenes import in_edges

import warp_contact as wc
from warp_contact import scenes

FPS = 60
LIMIT, QUICK_LIMIT = 400.0, 20.0  # wall seconds of one run
SETTINGS = {  # of each engine outside: fast, plain
    "Newton VBD": ((5, 5, 1, 0.1), (10, 10, 1, 0.1)),
    "Newton XPBD": ((10, 2, 0.2, 0.43), (10, 10, 0.2, 0.43)),
    "MuJoCo flex": ((4, 20, 2, 0.01), (8, 20, 2, 0.01)),
}


def two_blocks() -> wc.Scene:
    """A cube falls onto another one of its kind, which stands on a floor."""
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    rubber = wc.NeoHookean(5e4, 0.3, 1000.0, 1e-3)
    for z in (0.0505, 0.1705):
        scene.add_body(wc.box(0.1, 4), rubber, (0.0, 0.0, z))
    return scene


RACES: dict[str, tuple[Callable[[], wc.Scene], float, int]] = {  # scene, [s], settings
    "two_blocks": (two_blocks, 1.0, 2),
    "squeezed_sphere": (scenes.load("squeezed_sphere").build, 1.0, 2),
    "cubes_on_membrane": (scenes.load("cubes_on_membrane").build, 1.0, 2),
    "membrane_stack": (scenes.load("membrane_stack").build, 1.0, 1),
    "bowl": (scenes.load("bowl").build, 0.5, 1),
}
HEAD = f"{'scene':18s} {'engine':13s} {'steps':>6s} {'s / s':>8s} {'overlap':>9s} "
HEAD += f"{'at the end':>10s} {'inverted':>8s}"


def main() -> int:
    """Run, print, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", metavar="scene", help=f"of {', '.join(RACES)}")
    parser.add_argument("--quick", action="store_true", help="the fast settings, runs cut short")
    parser.add_argument("--out", type=Path, help="write the table there too")
    parser.add_argument("--python", default=sys.executable, help="interpreter with the engines")
    args = parser.parse_args()
    unknown = set(args.scenes) - set(RACES)
    if unknown:
        parser.error(f"no scene {', '.join(sorted(unknown))}; there are {', '.join(RACES)}")
    wp.config.log_level = wp.LOG_WARNING
    lines = [f"{cpu()}; Warp {wp.config.version}; outside: {versions(args.python)}", "", HEAD]
    print(*lines, sep="\n", flush=True)
    for name in args.scenes or RACES:
        build, seconds, settings = RACES[name]
        settings = 1 if args.quick else settings
        limit = QUICK_LIMIT if args.quick else LIMIT
        panel = Panel(name, "", build, FPS, round(seconds * FPS), lambda *_: 0.0, 1.0)
        for engine, motion in race(panel, settings, limit, args.python):
            lines.append(row(panel, engine, motion))
            print(lines[-1], flush=True)
    if args.out:
        args.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


def race(
    panel: Panel, settings: int, limit: float, python: str
) -> Iterator[tuple[str, Motion | Failed]]:
    """Each engine with its motion, or why there is none."""
    try:
        yield "warp_contact", ours.run(panel, methods.Own("default", "balanced"), None, limit)
    except Failed as failed:
        yield "warp_contact", failed
    for engine, values in SETTINGS.items():
        knobs = methods.SWEEPS[engine][0]
        chosen = [dict(zip(knobs, v, strict=True)) for v in values[:settings]]
        for motion in outside.run(panel, methods.PEERS[engine], chosen, python, limit):
            yield engine, motion


def row(panel: Panel, engine: str, motion: Motion | Failed) -> str:
    """A line of the table."""
    start = f"{panel.name:18s} {engine:13s}"
    if isinstance(motion, Failed):
        wall = "" if motion.wall is None else f"{motion.wall:.3g}"
        return f"{start} {'':6s} {wall:>8s}  {motion}"
    deepest, last, inverted = look(panel, motion)
    return f"{start} {motion.steps:6d} {motion.wall:8.3g} {deepest:9.2g} {last:10.2g} {inverted:8d}"


def look(panel: Panel, motion: Motion) -> tuple[float, float, int]:
    """Deepest overlap of all frames and of the last one [edges]; inverted tets at the end."""
    sim = wc.Simulation(panel.scene(), fps=panel.fps)
    found = []
    for x in motion.x:
        sim.state.x.assign(np.ascontiguousarray(x, dtype=np.float32))
        with wp.ScopedDevice(sim.device):
            measured = sim.measure()
            found.append(in_edges(sim, measured))
    return max(found), found[-1], measured.inverted


if __name__ == "__main__":
    sys.exit(main())
