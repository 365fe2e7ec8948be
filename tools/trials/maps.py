"""The maps: a table with a row per cell, and a picture per sweep."""

import csv
from collections.abc import Iterator
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.colors import ListedColormap

import warp_contact as wc
from trials.outcome import OUTCOMES
from trials.sweeps import FIGURES, SWEEPS, Sweep, cases, cell
from trials.watch import METHODS
from warp_contact.runs import FILE

COLUMNS = "sweep", "method", "x_name", "x", "y_name", "y", "outcome", *FIGURES
COLOURS = "#dcefdc", "#f6d55c", "#ed8b3b", "#c0392b", "#5b2c6f", "#8d99a6", "#1b1b1b", "#ffffff"
SHADES = {"cmap": ListedColormap(COLOURS), "vmin": -0.5, "vmax": len(OUTCOMES) - 0.5}


def draw(names: list[str], out: Path) -> None:
    """Run all cells, in processes; then write the table, and a picture of each sweep.

    Cells that have ended are kept in the folder until all have: a map that was stopped goes on.
    """
    cells = [case for name in names for method in METHODS for case in cases(name, method)]
    found = wc.sweep(cell, cells, out=out)
    with open(out / "map.csv", "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, COLUMNS)
        table.writeheader()
        for case, figures in zip(cells, found, strict=True):
            s = SWEEPS[case["sweep"]]
            table.writerow(case | {"x_name": s.x[0], "y_name": s.y[0]} | figures)
    outcomes = iter([figures["outcome"] for figures in found])
    for name in names:
        grids = {method: grid(name, method, outcomes) for method in METHODS}
        picture(SWEEPS[name], grids, out / f"{name}.png")
    (out / FILE).unlink()


def grid(name: str, method: str, outcomes: Iterator[str]) -> list[list[str]]:
    """The next outcomes, those of a method, by rows of equal y."""
    xs, ys = SWEEPS[name].axes()
    rows = [[next(outcomes) for _ in xs] for _ in ys]
    flat = [o for row in rows for o in row]
    counts = ", ".join(f"{o} {flat.count(o)}" for o in OUTCOMES if o in flat)
    print(f"{name:8}  {method:14}  {counts}", flush=True)
    return rows


def picture(s: Sweep, found: dict[str, list[list[str]]], path: Path) -> None:
    """A panel per method with the outcomes of its cells; they share a legend."""
    figure, axes = plt.subplots(2, 4, figsize=(16, 8), layout="constrained")
    figure.suptitle(s.title)
    for ax, (method, grid) in zip(axes.flat, found.items(), strict=False):
        ax.set_title(method)
        panel(ax, s, grid)
    for outcome, colour in zip(OUTCOMES, COLOURS, strict=True):
        axes.flat[0].scatter(
            [], [], s=120, marker="s", color=colour, edgecolor="grey", label=outcome
        )
    figure.legend(loc="outside lower center", ncols=len(OUTCOMES), fontsize=10)
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
