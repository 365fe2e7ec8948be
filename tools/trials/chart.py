"""The map: a table with a row per cell, a heat map per sweep with the frontier of what is fine.

The paper's scenes are marked where they lie (stable/paper.py).
"""

import csv
import sys
from functools import partial
from pathlib import Path

import numpy as np

from trials.outcome import FINE, OUTCOMES, Record, classify
from trials.paper import FIGURES, marks
from trials.setup import METHODS, attempt
from trials.sweeps import MOST_STEPS, SWEEPS, Sweep

COLUMNS = (
    *("sweep", "method", "x_name", "x", "y_name", "y", "outcome", "overlap", "energy_gained"),
    *("lowest_volume", "end_volume", "tunnelled", "touched", "steps", "time", "asked", "reason"),
)
COLOURS = "#dcefdc", "#f6d55c", "#ed8b3b", "#c0392b", "#5b2c6f", "#8d99a6", "#1b1b1b", "#ffffff"
LIMIT = 30.0  # seconds that a cell may take
KEY = "\n".join(
    [
        "The paper's scenes, by its figures",
        *(f"{figure:>4}  {scene}" for scene, (figure, *_) in FIGURES.items()),
        "grey on the rim: off the map",
    ]
)


def draw(names: list[str], quick: bool, out: Path) -> int:
    """Run the sweeps, write the table as they go and a picture after each."""
    plots = pyplot()
    if plots is None:
        print("no matplotlib: pip install 'warp_contact[plot]'", file=sys.stderr)
        return 1
    out.mkdir(parents=True, exist_ok=True)
    with open(out / "map.csv", "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(COLUMNS)
        for name in names:
            found = {method: sweep(name, method, quick, table, file) for method in METHODS}
            picture(plots, name, quick, found, out / f"{name}.png")
    return 0


def pyplot():
    """Matplotlib without a window, or None."""
    try:
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot

        return pyplot
    except ImportError:
        return None


def sweep(name: str, method: str, quick: bool, table, file) -> list[list[str]]:
    """The outcomes of all cells of a method, by rows of equal y."""
    s = SWEEPS[name]
    xs, ys = s.axes(quick)
    grid = []
    for y in ys.tolist():
        grid.append([])
        for x in xs.tolist():
            r = attempt(
                partial(s.build, x, y), method, most_steps=MOST_STEPS[not quick], limit=LIMIT
            )
            grid[-1].append(classify(r))
            table.writerow((name, method, s.x_name, x, s.y_name, y, *row(r)))
            file.flush()
    outcomes = [o for line in grid for o in line]
    counts = ", ".join(f"{o} {outcomes.count(o)}" for o in OUTCOMES if o in outcomes)
    print(f"{name:8}  {method:14}  {counts}", flush=True)
    return grid


def row(r: Record) -> tuple:
    """The figures of a cell."""
    state = r.overlap, r.gained, r.lowest, r.volume, r.tunnelled
    return classify(r), *state, r.touched, r.steps, r.time, r.asked, r.reason


def picture(plots, name: str, quick: bool, found: dict, path: Path) -> None:
    """A panel per method: colours of the outcomes, a line around what is fine, the scenes."""
    s = SWEEPS[name]
    xs, ys = s.axes(quick)
    scenes = marks(name, s.build(xs[0], ys[0]).scene)
    figure, axes = plots.subplots(2, 4, figsize=(16, 8), layout="constrained")
    figure.suptitle(s.title)
    for axis, (method, grid) in zip(axes.flat, found.items(), strict=False):
        codes = [[OUTCOMES.index(o) for o in line] for line in grid]
        colours = plots.matplotlib.colors.ListedColormap(COLOURS)
        axis.imshow(codes, origin="lower", cmap=colours, vmin=-0.5, vmax=len(OUTCOMES) - 0.5)
        for ends in frontier(grid):
            axis.plot(*ends, color="black", linewidth=2.0)
        if s.limit:
            axis.plot(*limit_line(s, xs, ys), color="black", linestyle=":", linewidth=1.5)
        for (i, j), (text, colour) in labels(scenes, xs, ys).items():
            box = {"boxstyle": "round,pad=0.15", "facecolor": colour, "linewidth": 0.8}
            axis.text(i, j, text, fontsize=8, ha="center", va="center", bbox=box)
        axis.set_title(method)
        axis.set_xticks(range(len(xs)), [f"{x:.2g}" for x in xs], rotation=90)
        axis.set_yticks(range(len(ys)), [f"{y:.2g}" for y in ys])
        axis.set_xlabel(s.x_name)
        axis.set_ylabel(s.y_name)
    legend = axes.flat[-1]
    legend.axis("off")
    for outcome, colour in zip(OUTCOMES, COLOURS, strict=True):
        legend.scatter([], [], s=120, marker="s", color=colour, edgecolor="grey", label=outcome)
    legend.plot([], [], color="black", linewidth=2.0, label="frontier of what is fine")
    if s.limit:
        legend.plot([], [], color="black", linestyle=":", label=s.limit[0])
    legend.legend(loc="upper center", fontsize=11, ncols=2)
    legend.text(0.02, 0.02, KEY, transform=legend.transAxes, fontsize=10, va="bottom")
    figure.savefig(path, dpi=100)
    plots.close(figure)


def limit_line(s: Sweep, xs: np.ndarray, ys: np.ndarray) -> tuple[list[float], list[float]]:
    """The line of the sweep's limit, as far as it lies on the map."""
    places = [(float(i), place(y, ys)) for i, y in enumerate(s.limit[1](xs).tolist())]
    on = [(i, j) for i, (j, off) in places if not off]
    return [i for i, _ in on], [j for _, j in on]


def labels(scenes: list[tuple], xs: np.ndarray, ys: np.ndarray) -> dict:
    """Text and colour of the marks by their place; scenes in one place share a mark."""
    found = {}
    for figure, x, y in scenes:
        (i, aside), (j, above) = place(x, xs), place(y, ys)
        colour = "lightgrey" if aside or above else "white"
        near = [at for at in found if np.hypot(at[0] - i, at[1] - j) < 0.04 * len(xs)]
        at = near[0] if near else (i, j)
        text = found[at][0] if near else ""
        if str(figure) not in text.split(", "):
            text = f"{text}, {figure}" if text else str(figure)
        found[at] = text, colour
    return found


def place(value: float, values: np.ndarray) -> tuple[float, bool]:
    """Where a value lies between the cells, and whether it is off the map, then on its rim."""
    last = len(values) - 1
    with np.errstate(divide="ignore"):
        at = last * float(np.log(value / values[0]) / np.log(values[-1] / values[0]))
    return float(np.clip(at, -0.5, last + 0.5)), not -0.5 <= at <= last + 0.5


def frontier(grid: list[list[str]]) -> list[tuple[tuple, tuple]]:
    """The sides between a cell that is fine and one that is not: (x, x), (y, y) of their ends."""
    sides = []
    for j, line in enumerate(grid):
        for i, outcome in enumerate(line):
            if i + 1 < len(line) and (outcome == FINE) != (line[i + 1] == FINE):
                sides.append(((i + 0.5, i + 0.5), (j - 0.5, j + 0.5)))
            if j + 1 < len(grid) and (outcome == FINE) != (grid[j + 1][i] == FINE):
                sides.append(((i - 0.5, i + 0.5), (j + 0.5, j + 0.5)))
    return sides
