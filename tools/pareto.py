"""Draw error against CPU time, for this package and for engines outside.

    python tools/pareto.py [task ...] [--out DIR] [--python PATH] [--repeats N]
    python tools/pareto.py --draw FILE

Every method simulates the same vertices, tets and masses at the same frame rate on the CPU, is
given the same coefficient of damping (what each makes of it stands in ``tools/engines``), and is
judged by its positions alone. Contact detection is inside the time; compiling, loading and the
first frame are outside and stand in a column of their own. An engine that is not installed under
``--python`` is in the table with that reason. Writes pareto.csv, the pictures pareto.png with all
panels, summary.png with four of them and growth.png (``chart/growth.py``), and pareto.txt; what was
stopped goes on where it was. ``--draw`` measures nothing: it draws the pictures of a table again.
"""

import sys
from pathlib import Path
from statistics import median

from chart import closed_forms, growth, points, scenes
from chart.panel import Panel
from chart.points import Point
from engines import ours
from engines.runs import SWEEPS, runs, versions
from engines.task import Failed, Motion, Task
from measure import machine
from measure.run import command_line, count, one_of

import warp_contact as wc
from warp_contact.runs import FILE

TASKS = closed_forms.TASKS | {name: scenes.scene(name) for name in scenes.TITLES} | growth.TASKS
LIMIT = 12.0  # CPU s of one run
PENALTIES = "penalty", "virtual"
HEAD = """Error against CPU time, {} run(s) of each.
{}; outside: {}.
Times are of the CPU, so that other work on the machine counts little; each engine uses one thread.
Kernels are compiled and the first frame is stepped before the clock starts. Failures are behind \
everything. Error and time of a method are those of the same setting."""


def main() -> int:
    """Run, draw, write."""
    parser = command_line(__doc__)
    parser.add_argument("tasks", nargs="*", type=one_of(TASKS), metavar="task", help="or all")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "results" / "pareto")
    parser.add_argument("--python", default=sys.executable, help="interpreter with the engines")
    parser.add_argument("--repeats", type=count, default=3, help="of all; times are medians")
    parser.add_argument("--draw", type=Path, metavar="FILE", help="a table to draw again")
    args = parser.parse_args()
    chosen = {name: TASKS[name] for name in args.tasks or TASKS}
    titles = {panel.name: panel.title for _, panels in chosen.values() for panel in panels}
    if args.draw:
        draw(args.draw.parent, titles, shown(points.read(args.draw)))
        return 0
    repeats = range(args.repeats)
    cases = [{"name": n, "repeat": k, "python": args.python} for n in chosen for k in repeats]
    rows = wc.sweep(measured, cases, 1, out=args.out)  # one process: others would share its caches
    rounds = [[Point(*row) for part in rows[k :: args.repeats] for row in part] for k in repeats]
    found = [middle(same) for same in zip(*rounds, strict=True)]
    head = HEAD.format(args.repeats, machine.line("cpu"), versions(args.python))
    points.write(args.out / "pareto.csv", found)
    text = points.report(head, titles, shown(found))
    (args.out / "pareto.txt").write_text(text, encoding="utf-8")
    print(text)
    draw(args.out, titles, shown(found))
    (args.out / FILE).unlink()
    return 0


def measured(name: str, repeat: int, python: str) -> list[list]:
    """All points of a task; ``repeat`` tells one time from another."""
    task, panels = TASKS[name]
    each = runs(task, *growth.WHO.get(name, (ours.ALL, SWEEPS)), python, LIMIT)
    return [list(point) for run in each for point in judge(task, panels, *run)]


def judge(task: Task, panels: list[Panel], method: str, setting: str, motion: Motion):
    """The points of a run in all panels, printed as they come."""
    for panel in panels:
        error, outcome = None, motion.reason
        try:
            if not outcome:
                error, outcome = panel.error(task, motion), "ok"
        except Failed as failed:
            outcome = str(failed)
        point = Point(panel.name, method, setting, motion.cpu, error, outcome, motion.startup)
        print(*point, sep="  ", flush=True)
        yield point


def middle(same: tuple[Point, ...]) -> Point:
    """Repeats of a point as one; a run that fails once has failed."""
    failed = [p for p in same if p.error is None]
    return failed[0] if failed else same[0]._replace(cpu=median(p.cpu for p in same))


def shown(found: list[Point]) -> list[Point]:
    """Of the penalties of a panel those with the best stiffness only, and everything else."""
    penalties = [p for p in found if p.method in PENALTIES and p.error is not None]
    worst_first = sorted(penalties, key=points.BY_ERROR, reverse=True)
    best = {(p.panel, p.method): p.setting.partition("steps")[0] for p in worst_first}
    return [p for p in found if p.setting.startswith(best.get((p.panel, p.method), ""))]


def draw(folder: Path, titles: dict[str, str], found: list[Point]) -> None:
    """The picture of all panels, that of four, and that of how times grow."""
    try:
        from chart import picture
    except ImportError:
        print("no pictures: pip install 'warp_contact[plot]'", file=sys.stderr)
        return
    there = {p.panel for p in found}
    errors = {name: title for name, title in titles.items() if name not in growth.TASKS}
    if errors:
        picture.draw(folder / "pareto.png", errors, found)
    if there.issuperset(picture.SUMMARY):
        picture.draw(folder / "summary.png", picture.SUMMARY, found)
    if there.issuperset(growth.TASKS):
        growth.draw(folder / "growth.png", found)


if __name__ == "__main__":
    sys.exit(main())
