"""Draw error against wall time, for this package and for engines outside.

    python tools/pareto.py [panel ...] [--quick] [--out DIR] [--python PATH] [--repeats N]

Every method simulates the same vertices, tets and masses at the same frame rate on the CPU, is
given the same coefficient of damping (what each makes of it stands in ``tools/peers``), and is
judged by its positions alone. Contact detection is inside the time; compiling, loading and the
first frame are outside and stand in a column of their own. An engine that is not installed under
``--python`` is in the table with that reason. Writes pareto.csv, pareto.png and pareto.txt.
"""

import argparse
import datetime
import platform
import statistics
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter

import warp as wp
from charting import cases, methods, ours, outside, paper, result, words
from charting.front import best_knob
from charting.panel import Failed, Motion, Panel
from charting.result import Point

PANELS = {
    "A1": cases.springs,
    "A3": cases.pressed,
    "A6": cases.free,
    "A7m": cases.ladder,
    "squeezed_sphere": partial(paper.scene, "squeezed_sphere"),
    "cubes_on_membrane": partial(paper.scene, "cubes_on_membrane"),
}
LIMIT, QUICK_LIMIT = 12.0, 8.0  # wall seconds of one run
QUICK_TOTAL = 390.0  # wall seconds of the quick run, imports apart; late runs are cut to fit
EARLY = 2.5  # times its even share of what is left that a run may take
REPEATS = 3  # of everything, in turn; times are medians
PACKAGES = "newton", "mujoco", "warp-lang"


def main() -> int:
    """Run, draw, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("panels", nargs="*", metavar="panel", help=f"of {', '.join(PANELS)}")
    parser.add_argument("--quick", action="store_true", help="fewer settings, each once")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "results" / "pareto")
    parser.add_argument("--python", default=sys.executable, help="interpreter with the engines")
    parser.add_argument("--repeats", type=int, help=f"{REPEATS}, quick: 1")
    args = parser.parse_args()
    unknown = set(args.panels) - set(PANELS)
    if unknown:
        parser.error(f"no panel {', '.join(sorted(unknown))}; there are {', '.join(PANELS)}")
    wp.config.log_level = wp.LOG_WARNING
    begin = perf_counter()
    repeats = args.repeats or (1 if args.quick else REPEATS)
    rounds, titles, names = [], {}, args.panels or list(PANELS)
    for _ in range(repeats):
        points = []
        for k, name in enumerate(names):
            shown = PANELS[name](args.quick)
            titles.update({p.name: p.title for p in (shown, *shown.also)})
            limit = LIMIT
            if args.quick:
                left = (QUICK_TOTAL - perf_counter() + begin) / (len(names) - k)
                limit = min(QUICK_LIMIT, max(1.0, EARLY * left / count(True)))
            points += one(shown, args.quick, args.python, limit)
        rounds.append(points)
        # After every round: a long run leaves what it has.
        points = choose([median(same) for same in zip(*rounds, strict=True)])
        save(args.out, head(args.python, len(rounds), perf_counter() - begin), titles, points)
    return 0


def count(quick: bool) -> int:
    """Runs in a panel."""
    return len(methods.own(quick)) + sum(len(methods.outside(m, quick)) for m in methods.PEERS)


def one(panel: Panel, quick: bool, python: str, limit: float) -> list[Point]:
    """Every method in one panel, printed as they come."""
    points, steps = [], {}
    for setting in methods.own(quick):
        alike = setting.method, setting.times
        try:
            if setting.factor == 1:
                motion = ours.run(panel, setting, None, limit)
                steps[alike] = motion.steps
            elif alike in steps:
                motion = ours.run(panel, setting, setting.factor * steps[alike], limit)
            else:
                raise Failed("no run with steps x1")
        except Failed as failed:
            motion = failed
        points += judge(panel, setting.method, str(setting), motion)
    for method, adapter in methods.PEERS.items():
        settings = methods.outside(method, quick)
        motions = outside.run(panel, adapter, settings, python, limit)
        for setting, motion in zip(settings, motions, strict=True):
            said = ", ".join(f"{key} {value:g}" for key, value in setting.items())
            points += judge(panel, method, said, motion)
    return points


def judge(panel: Panel, method: str, setting: str, motion: Motion | Failed) -> list[Point]:
    """The errors of a run; those of ``also`` too."""
    points = []
    for p in (panel, *panel.also):
        if isinstance(motion, Failed):
            point = Point(p.name, method, setting, motion.wall, None, str(motion))
        else:
            point = Point(p.name, method, setting, motion.wall, None, startup=motion.startup)
            try:
                point = replace(point, error=p.error(p, motion))
            except Failed as failed:
                point = replace(point, outcome=str(failed))
        print(*(x for x in result.cells(point)), sep="  ", flush=True)
        points.append(point)
    return points


def median(same: tuple[Point, ...]) -> Point:
    """Repeats of a point as one; a run that fails once has failed."""
    for p in same:
        if p.failed:
            return p
    return replace(same[0], wall=statistics.median(p.wall for p in same))


def choose(points: list[Point]) -> list[Point]:
    """Of the penalties of a panel, show those with the best stiffness only."""
    out = []
    for p in points:
        mine = [q for q in points if (q.panel, q.method) == (p.panel, "penalty")]
        best = best_knob(mine, _stiffness)
        hidden = p.method == "penalty" and best is not None and _stiffness(p) != best
        out.append(replace(p, shown=not hidden))
    return out


def save(folder: Path, first: str, titles: dict[str, str], points: list[Point]) -> None:
    """Table, words and, where matplotlib is installed, picture."""
    folder.mkdir(parents=True, exist_ok=True)
    result.write(folder / "pareto.csv", points)
    text = words.report(first, titles, result.read(folder / "pareto.csv"))
    (folder / "pareto.txt").write_text(text, encoding="utf-8")
    try:
        from charting import plot
    except ImportError:
        print("no picture: matplotlib is not installed (extra 'plot')")
    else:
        plot.draw(folder / "pareto.png", titles, points)
    print(text)


def head(python: str, repeats: int, seconds: float) -> str:
    """Date, machine, versions, rules."""
    today = datetime.date.today().isoformat()
    lines = [
        f"Error against wall time, {today}, {repeats} run(s) of each, {seconds:.0f} s in all.",
        f"{platform.system()} {platform.machine()}, {cpu()}, Python {platform.python_version()}, "
        f"Warp {wp.config.version} on cpu; outside: {versions(python)}.",
        "Kernels are compiled and the first frame is stepped before the clock starts. Failures are "
        "behind everything. Error and time of a method are those of the same setting.",
    ]
    return "\n".join(lines)


def cpu() -> str:
    """The processor."""
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        if lines:
            return f"{lines[0].split(':')[1].strip()}, {len(lines)} core(s)"
    return platform.processor() or "unknown processor"


def versions(python: str) -> str:
    """What is installed under an interpreter of the engines outside."""
    code = (
        "from importlib import metadata as m\n"
        f"for p in {PACKAGES}:\n"
        " try: print(p, m.version(p))\n"
        " except m.PackageNotFoundError: print(p, 'not installed')"
    )
    done = subprocess.run([python, "-c", code], capture_output=True, text=True)
    return ", ".join(done.stdout.splitlines()) or f"no interpreter ({python})"


def _stiffness(point: Point) -> str:
    return point.setting.split(",")[0]


if __name__ == "__main__":
    sys.exit(main())
