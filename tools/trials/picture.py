"""A heat map per sweep: outcomes, the frontier of what is fine, the scenes of ``marks.py``."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.colors import ListedColormap

from trials.marks import FIGURES, frontier, labels, limit_line, marks
from trials.outcome import OUTCOMES
from trials.sweeps import Sweep

COLOURS = "#dcefdc", "#f6d55c", "#ed8b3b", "#c0392b", "#5b2c6f", "#8d99a6", "#1b1b1b", "#ffffff"
KEY = "\n".join(
    [
        "The paper's scenes, by its figures",
        *(f"{figure:>4}  {scene}" for scene, (figure, *_) in FIGURES.items()),
        "grey on the rim: off the map",
    ]
)
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
