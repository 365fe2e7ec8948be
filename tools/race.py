"""Scenes of many contacts side by side with engines outside: time, overlap, inverted tets.

    python tools/race.py [scene ...] [--python PATH]

Every engine gets the same vertices, tets, masses and coefficient of damping and is judged from its
positions, as in ``tools/pareto.py``; each runs once, in one thread. Nothing is swept: the settings
are a fast and a plain one of each engine, in large scenes the fast one.

    steps       of a frame
    s / s       CPU seconds per simulated second, compiling and the first frame left out
    overlap     deepest one after any frame, in edges of the finer body
    at the end  the same after the last frame
    inverted    tets that are inside out after the last frame
"""

import sys

from chart.scenes import overlaps
from engines.ours import DEFAULT, IMPLICIT
from engines.runs import SWEEPS, runs, versions
from engines.task import Motion, Task
from measure import machine
from measure.report import Table
from measure.run import command_line, one_of

import warp_contact as wc
from warp_contact.scenes import load

FPS = 60
LIMIT = 400.0  # CPU s of one run
SETTINGS = {"Newton VBD": (1, 5), "Newton XPBD": (8, 4), "MuJoCo flex": (2, 5)}  # fast, plain
OURS = {DEFAULT.method: "ours", IMPLICIT.method: "ours implicit"}
COLUMNS = {"scene": 18, "engine": 13, "steps": 6, "s / s": 8, "overlap": 9, "at the end": 10}
TABLE = Table(**COLUMNS, inverted=0)


APART, INSIDE = ((0.0, 0.0, 0.0505), (0.0, 0.0, 0.1705)), ((0.0, 0.0, 0.05), (0.003, 0.002, 0.145))


def two_blocks(places=APART) -> wc.Scene:
    """A cube falls onto another one of its kind, which stands on a floor."""
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    rubber = wc.NeoHookean(5e4, 0.3, 1000.0, 1e-3)
    for place in places:
        scene.add_body(wc.box(0.1, 4), rubber, place)
    return scene


def starts_inside() -> wc.Scene:
    """The same two, the upper one 5 mm inside the lower one at the start."""
    return two_blocks(INSIDE)


RACES = {  # scene, time [s], settings of each engine outside
    "two_blocks": (two_blocks, 1.0, 2),
    "starts_inside": (starts_inside, 1.0, 2),
    "squeezed_sphere": (load("squeezed_sphere").build, 1.0, 2),
    "cubes_on_membrane": (load("cubes_on_membrane").build, 1.0, 2),
    "membrane_stack": (load("membrane_stack").build, 1.0, 1),
    "bowl": (load("bowl").build, 0.5, 1),
}


def main() -> int:
    """Run, print, write."""
    parser = command_line(__doc__)
    parser.add_argument("scenes", nargs="*", type=one_of(RACES), metavar="scene", help="or all")
    parser.add_argument("--python", default=sys.executable, help="interpreter with the engines")
    args = parser.parse_args()
    print(f"{machine.line('cpu')}; outside: {versions(args.python)}\n\n{TABLE.head()}", flush=True)
    for name in args.scenes or RACES:
        build, seconds, count = RACES[name]
        task = Task(build, FPS, round(seconds * FPS))
        others = {e: [SWEEPS[e][k] for k in rows[:count]] for e, rows in SETTINGS.items()}
        for engine, _, motion in runs(task, [DEFAULT, IMPLICIT], others, args.python, LIMIT):
            print(TABLE.line(name, OURS.get(engine, engine), *cells(task, motion)), flush=True)
    return 0


def cells(task: Task, motion: Motion) -> list[str]:
    """Of the line of a motion; that of a failure ends with its reason."""
    cpu = "" if motion.cpu is None else f"{motion.cpu:.3g}"
    if motion.reason:
        return ["", cpu, "", "", motion.reason]
    deepest, last, inverted = look(task, motion)
    return [str(motion.steps), cpu, f"{deepest:.2g}", f"{last:.2g}", str(inverted)]


def look(task: Task, motion: Motion) -> tuple[float, float, int]:
    """Deepest overlap of all frames and of the last one [edges]; inverted tets at the end."""
    found, measures = zip(*overlaps(task, motion), strict=True)
    return max(found), found[-1], measures[-1].inverted


if __name__ == "__main__":
    sys.exit(main())
