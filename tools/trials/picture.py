"""A heat map per sweep: outcomes, the frontier of what is fine, the sweep's limit."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.colors import ListedColormap

from trials.outcome import OUTCOMES
from trials.sweeps import Sweep, frontier, limit_line

COLOURS = "#dcefdc", "#f6d55c", "#ed8b3b", "#c0392b", "#5b2c6f", "#8d99a6", "#1b1b1b", "#ffffff"
SHADES = {"cmap": ListedColormap(COLOURS), "vmin": -0.5, "vmax": len(OUTCOMES) - 0.5}
LINE = {"color": "black", "linewidth": 2.0}
DOTS = {"color": "black", "linewidth": 1.5, "linestyle": ":"}


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
    legend.plot([], [], label="frontier of what is fine", **LINE)
    if s.limit:
        legend.plot([], [], label=s.limit[0], **DOTS)
    legend.legend(loc="center", fontsize=10)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def panel(ax, s: Sweep, grid: list[list[str]]) -> None:
    """Colours of the outcomes, a line around what is fine, the limit."""
    ax.imshow([[OUTCOMES.index(o) for o in row] for row in grid], origin="lower", **SHADES)
    for ends in frontier(grid):
        ax.plot(*ends, **LINE)
    if s.limit:
        ax.plot(*limit_line(s), **DOTS)
    xs, ys = s.axes()
    ax.set_xticks(range(len(xs)), [f"{x:.2g}" for x in xs], rotation=90)
    ax.set_yticks(range(len(ys)), [f"{y:.2g}" for y in ys])
    ax.set_xlabel(s.x[0])
    ax.set_ylabel(s.y[0])
