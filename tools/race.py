"""Scenes of many contacts side by side with engines outside: time, overlap, inverted tets.

    python tools/race.py [scene ...] [--quick] [--out FILE] [--python PATH]

Every engine gets the same vertices, tets, masses and coefficient of damping and is judged from its
positions, as in ``tools/pareto.py``; each runs once, so that no time is better than the machine is
quiet. Nothing is swept: the settings are a fast and a plain one of each engine, in large scenes the
fast one.

    steps       of a frame
    s / s       wall seconds per simulated second, compiling and the first frame left out
    overlap     deepest one after any frame, in edges of the finer body
    at the end  the same after the last frame
    inverted    tets that are inside out after the last frame
"""

import sys
from collections.abc import Callable
from pathlib import Path

from chart.scenes import overlaps
from engines import outside
from engines.runs import runs
from engines.settings import DEFAULT, SWEEPS
from engines.task import Failed, Motion, Task
from measure import machine
from measure.report import Table
from measure.run import command_line, one_of

import warp_contact as wc
from warp_contact import scenes

FPS = 60
LIMIT, QUICK_LIMIT = 400.0, 20.0  # wall seconds of one run
SETTINGS = {  # of each engine outside: fast, plain
    "Newton VBD": ((5, 5, 1, 0.1), (10, 10, 1, 0.1)),
    "Newton XPBD": ((10, 2, 0.2, 0.43), (10, 10, 0.2, 0.43)),
    "MuJoCo flex": ((4, 20, 2, 0.01), (8, 20, 2, 0.01)),
}
COLUMNS = {"scene": 18, "engine": 13, "steps": 6, "s / s": 8, "overlap": 9, "at the end": 10}
TABLE = Table(**COLUMNS, inverted=0)


def two_blocks() -> wc.Scene:
    """A cube falls onto another one of its kind, which stands on a floor."""
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    rubber = wc.NeoHookean(5e4, 0.3, 1000.0, 1e-3)
    for z in (0.0505, 0.1705):
        scene.add_body(wc.box(0.1, 4), rubber, (0.0, 0.0, z))
    return scene


OURS = {DEFAULT.method: "warp_contact"}
RACES: dict[str, tuple[Callable[[], wc.Scene], float, int]] = {  # scene, [s], settings
    "two_blocks": (two_blocks, 1.0, 2),
    "squeezed_sphere": (scenes.load("squeezed_sphere").build, 1.0, 2),
    "cubes_on_membrane": (scenes.load("cubes_on_membrane").build, 1.0, 2),
    "membrane_stack": (scenes.load("membrane_stack").build, 1.0, 1),
    "bowl": (scenes.load("bowl").build, 0.5, 1),
}


def main() -> int:
    """Run, print, write."""
    parser = command_line(__doc__)
    parser.add_argument("scenes", nargs="*", type=one_of(RACES), metavar="scene", help="or all")
    parser.add_argument("--quick", action="store_true", help="the fast settings, runs cut short")
    parser.add_argument("--out", type=Path, help="write the table there too")
    parser.add_argument("--python", default=sys.executable, help="interpreter with the engines")
    args = parser.parse_args()
    lines = [f"{machine.line('cpu')}; outside: {outside.versions(args.python)}", "", TABLE.head()]
    print(*lines, sep="\n", flush=True)
    for name in args.scenes or RACES:
        build, seconds, settings = RACES[name]
        task = Task(build, FPS, round(seconds * FPS))
        settings, limit = (1, QUICK_LIMIT) if args.quick else (settings, LIMIT)
        others = fast_and_plain(settings)
        for engine, _, motion in runs(task, [DEFAULT], others, args.python, limit):
            lines.append(row(name, task, OURS.get(engine, engine), motion))
            print(lines[-1], flush=True)
    if args.out:
        args.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


def fast_and_plain(count: int) -> dict[str, list[dict]]:
    """So many settings of each engine outside."""
    return {
        engine: [dict(zip(SWEEPS[engine][0], v, strict=True)) for v in values[:count]]
        for engine, values in SETTINGS.items()
    }


def row(name: str, task: Task, engine: str, motion: Motion | Failed) -> str:
    """A line of the table; a failure ends with its reason."""
    if isinstance(motion, Failed):
        wall = "" if motion.wall is None else f"{motion.wall:.3g}"
        return TABLE.line(name, engine, "", wall, "", "", str(motion))
    deepest, last, inverted = look(task, motion)
    cells = str(motion.steps), f"{motion.wall:.3g}", f"{deepest:.2g}", f"{last:.2g}", str(inverted)
    return TABLE.line(name, engine, *cells)


def look(task: Task, motion: Motion) -> tuple[float, float, int]:
    """Deepest overlap of all frames and of the last one [edges]; inverted tets at the end."""
    found, measures = zip(*overlaps(task, motion), strict=True)
    return max(found), found[-1], measures[-1].inverted


if __name__ == "__main__":
    sys.exit(main())
