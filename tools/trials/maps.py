"""The maps: a table with a row per cell, and a picture per sweep."""

import csv
from functools import partial
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.colors import ListedColormap

from trials.outcome import OUTCOMES, classify
from trials.sweeps import SWEEPS, Sweep
from trials.watch import METHODS, attempt

FIGURES = {  # of a cell: its columns, and the fields of its record
    "overlap": "overlap",
    "energy_gained": "gained",
    "lowest_volume": "lowest",
    "end_volume": "volume",
    **{name: name for name in ("tunnelled", "touched", "steps", "time", "asked", "reason")},
}
COLUMNS = "sweep", "method", "x_name", "x", "y_name", "y", "outcome", *FIGURES
CUT = {"most_steps": 6000, "limit": 30.0}  # steps and seconds that a cell may take
COLOURS = "#dcefdc", "#f6d55c", "#ed8b3b", "#c0392b", "#5b2c6f", "#8d99a6", "#1b1b1b", "#ffffff"
SHADES = {"cmap": ListedColormap(COLOURS), "vmin": -0.5, "vmax": len(OUTCOMES) - 0.5}


def draw(names: list[str], out: Path) -> None:
    """Run the sweeps, write the table as they go and a picture after each."""
    out.mkdir(parents=True, exist_ok=True)
    with open(out / "map.csv", "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(COLUMNS)
        for name in names:
            found = {method: sweep(name, method, table.writerow) for method in METHODS}
            picture(SWEEPS[name], found, out / f"{name}.png")


def sweep(name: str, method: str, write) -> list[list[str]]:
    """The outcomes of all cells of a method, by rows of equal y; ``write`` takes each row."""
    s, grid = SWEEPS[name], []
    xs, ys = (axis.tolist() for axis in s.axes())
    for y in ys:
        grid.append([])
        for x in xs:
            r = attempt(partial(s.build, x, y), method, **CUT)
            grid[-1].append(classify(r))
            figures = [getattr(r, field) for field in FIGURES.values()]
            write((name, method, s.x[0], x, s.y[0], y, classify(r), *figures))
    outcomes = [o for row in grid for o in row]
    counts = ", ".join(f"{o} {outcomes.count(o)}" for o in OUTCOMES if o in outcomes)
    print(f"{name:8}  {method:14}  {counts}", flush=True)
    return grid


def picture(s: Sweep, found: dict[str, list[list[str]]], path: Path) -> None:
    """A panel per method with the outcomes of its cells; they share a legend."""
    figure, axes = plt.subplots(2, 4, figsize=(16, 8), layout="constrained")
    figure.suptitle(s.title)
    for ax, (method, grid) in zip(axes.flat, found.items(), strict=False):
        ax.set_title(method)
        panel(ax, s, grid)
    legend = axes.flat[-1]
    legend.axis("off")
    for outcome, colour in zip(OUTCOMES, COLOURS, strict=True):
        legend.scatter([], [], s=120, marker="s", color=colour, edgecolor="grey", label=outcome)
    legend.legend(loc="center", fontsize=10)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def panel(ax, s: Sweep, grid: list[list[str]]) -> None:
    """Colours of the outcomes, and the values of both axes."""
    ax.imshow([[OUTCOMES.index(o) for o in row] for row in grid], origin="lower", **SHADES)
    xs, ys = s.axes()
    ax.set_xticks(range(len(xs)), [f"{x:.2g}" for x in xs], rotation=90)
    ax.set_yticks(range(len(ys)), [f"{y:.2g}" for y in ys])
    ax.set_xlabel(s.x[0])
    ax.set_ylabel(s.y[0])
