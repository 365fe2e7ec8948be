"""A heat map per sweep: outcomes, the frontier of what is fine, the paper's scenes (``marks.py``)."""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.colors import ListedColormap

from trials.marks import FIGURES, marks
from trials.outcome import FINE, OUTCOMES
from trials.sweeps import Sweep

COLOURS = "#dcefdc", "#f6d55c", "#ed8b3b", "#c0392b", "#5b2c6f", "#8d99a6", "#1b1b1b", "#ffffff"
KEY = "\n".join(
    [
        "The paper's scenes, by its figures",
        *(f"{figure:>4}  {scene}" for scene, (figure, *_) in FIGURES.items()),
        "grey on the rim: off the map",
    ]
)
CLOSE = 0.04  # of the map: marks that are nearer share one
LINE = {"color": "black", "linewidth": 2.0}
DOTS = {"color": "black", "linewidth": 1.5, "linestyle": ":"}


def picture(s: Sweep, name: str, quick: bool, found: dict, path: Path) -> None:
    """A panel per method with the outcomes of its cells; they share a legend."""
    scenes = marks(name, s.build(s.x[0], s.y[0]).scene)
    figure, axes = plt.subplots(2, 4, figsize=(16, 8), layout="constrained")
    figure.suptitle(s.title)
    for ax, (method, grid) in zip(axes.flat, found.items(), strict=False):
        ax.set_title(method)
        panel(ax, s, s.axes(quick), grid, scenes)
    legend(axes.flat[-1], s)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def panel(ax, s: Sweep, values: tuple, grid: list[list[str]], scenes: list[tuple]) -> None:
    """Colours of the outcomes, a line around what is fine, the limit, the scenes."""
    xs, ys = values
    codes = [[OUTCOMES.index(o) for o in line] for line in grid]
    colours = {"cmap": ListedColormap(COLOURS), "vmin": -0.5, "vmax": len(OUTCOMES) - 0.5}
    ax.imshow(codes, origin="lower", **colours)
    for ends in frontier(grid):
        ax.plot(*ends, **LINE)
    if s.limit:
        ax.plot(*limit_line(s, xs, ys), **DOTS)
    for (i, j), (text, colour) in labels(scenes, xs, ys).items():
        box = {"boxstyle": "round,pad=0.15", "facecolor": colour, "linewidth": 0.8}
        ax.text(i, j, text, fontsize=8, ha="center", va="center", bbox=box)
    ax.set_xticks(range(len(xs)), [f"{x:.2g}" for x in xs], rotation=90)
    ax.set_yticks(range(len(ys)), [f"{y:.2g}" for y in ys])
    ax.set_xlabel(s.x_name)
    ax.set_ylabel(s.y_name)


def legend(ax, s: Sweep) -> None:
    """What colours, lines and marks are."""
    ax.axis("off")
    for outcome, colour in zip(OUTCOMES, COLOURS, strict=True):
        ax.scatter([], [], s=120, marker="s", color=colour, edgecolor="grey", label=outcome)
    ax.plot([], [], label="frontier of what is fine", **LINE)
    if s.limit:
        ax.plot([], [], label=s.limit[0], **DOTS)
    ax.legend(loc="upper center", fontsize=11, ncols=2)
    ax.text(0.02, 0.02, KEY, transform=ax.transAxes, fontsize=10, va="bottom")


def limit_line(s: Sweep, xs: np.ndarray, ys: np.ndarray) -> tuple[list[float], list[float]]:
    """The line of the sweep's limit, as far as it lies on the map."""
    places = [(float(i), place(y, ys)) for i, y in enumerate(s.limit[1](xs).tolist())]
    on = [(i, j) for i, (j, off) in places if not off]
    return [i for i, _ in on], [j for _, j in on]


def labels(scenes: list[tuple], xs: np.ndarray, ys: np.ndarray) -> dict:
    """Text and colour of the marks by their place; scenes in one place share a mark."""
    found: dict[tuple, list] = {}
    for figure, x, y in scenes:
        (i, aside), (j, above) = place(x, xs), place(y, ys)
        near = (at for at in found if np.hypot(at[0] - i, at[1] - j) < CLOSE * len(xs))
        mark = found.setdefault(next(near, (i, j)), [])
        mark.append((str(figure), "lightgrey" if aside or above else "white"))
    return {at: (", ".join(dict.fromkeys(f for f, _ in m)), m[-1][1]) for at, m in found.items()}


def place(value: float, values: np.ndarray) -> tuple[float, bool]:
    """Where a value lies between the cells, and whether it is off the map, then on its rim."""
    last = len(values) - 1
    with np.errstate(divide="ignore"):
        at = last * float(np.log(value / values[0]) / np.log(values[-1] / values[0]))
    return float(np.clip(at, -0.5, last + 0.5)), not -0.5 <= at <= last + 0.5


def frontier(grid: list[list[str]]) -> list[tuple[tuple, tuple]]:
    """The sides between a cell that is fine and one that is not: (x, x), (y, y) of their ends."""
    fine = np.array(grid) == FINE
    right, above = fine[:, 1:] != fine[:, :-1], fine[1:] != fine[:-1]
    sides = [((i + 0.5, i + 0.5), (j - 0.5, j + 0.5)) for j, i in np.argwhere(right).tolist()]
    return sides + [
        ((i - 0.5, i + 0.5), (j + 0.5, j + 0.5)) for j, i in np.argwhere(above).tolist()
    ]
