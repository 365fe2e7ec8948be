"""The picture: error against wall time, one panel each, failures on a rail at the top."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.transforms import blended_transform_factory as blend

from charting.front import front
from charting.result import Point

STYLES = {  # method: (colour, marker)
    "default": ("#c8401e", "o"),
    "literal": ("#e8a33d", "D"),
    "impulses alone": ("#8a5a9e", "p"),
    "predicted": ("#3d9a93", "h"),
    "penalty": ("#7a7a7a", "v"),
    "Newton VBD": ("#2060a8", "s"),
    "Newton XPBD": ("#5fa8d8", "^"),
    "MuJoCo flex": ("#2f8a4a", "P"),
}
OTHER = "black", "x"
FLOOR = 0.1  # an error of zero is drawn at this part of the smallest other one, and marked
RAIL = 1.06  # height of the rail, of the panel
WORDS = 34  # characters of a reason
COLUMNS = 2


def draw(path: Path, titles: dict[str, str], points: list[Point]) -> None:
    """One PNG with all panels; ``titles`` by the name of the panel."""
    rows = -(-len(titles) // COLUMNS)
    size = (7.0 * COLUMNS, 5.6 * rows)
    figure, axes = plt.subplots(rows, COLUMNS, figsize=size, squeeze=False, layout="constrained")
    for ax in axes.flat[len(titles) :]:
        ax.set_visible(False)
    for ax, (name, title) in zip(axes.flat, titles.items(), strict=False):
        panel(ax, title, [p for p in points if p.panel == name and p.shown])
    known = dict.fromkeys(p.method for p in points)
    handles = [
        plt.Line2D([], [], color=c, marker=m, label=name)
        for name in known
        for c, m in (STYLES.get(name, OTHER),)
    ]
    handles.append(plt.Line2D([], [], color="black", linewidth=6, alpha=0.12, label="front"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def panel(ax, title: str, points: list[Point]) -> None:
    """Points, the front of each method, that of all, and the rail."""
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_title(title, fontsize=10, pad=42)
    ax.set_xlabel("wall seconds per simulated second")
    ax.set_ylabel("error")
    ax.grid(True, which="major", color="0.9")
    fine = [p for p in points if not p.failed]
    floor = FLOOR * min((p.error for p in fine if p.error > 0.0), default=1.0)
    curve(ax, front(points), floor, color="black", linewidth=6, alpha=0.12)
    for method in dict.fromkeys(p.method for p in points):
        colour, marker = STYLES.get(method, OTHER)
        mine = [p for p in fine if p.method == method]
        x, y = [p.wall for p in mine], [p.error or floor for p in mine]
        ax.plot(x, y, color=colour, marker=marker, linestyle="", markersize=5)
        curve(ax, front(mine), floor, color=colour, linewidth=1.0)
    if any(p.error == 0.0 for p in fine):
        ax.text(1.01, floor, "0", transform=blend(ax.transAxes, ax.transData), va="center")
    rail(ax, [p for p in points if p.failed])


def curve(ax, ahead: list[Point], floor: float, **style) -> None:
    """The best a method, or all of them, reach within a time."""
    y = [p.error or floor for p in ahead]
    ax.step([p.wall for p in ahead], y, where="post", **style)


def rail(ax, failed: list[Point]) -> None:
    """Each failure above the panel, at its time or, where it has none, at the right end.

    Equal reasons of a method are said once, with their count.
    """
    at = blend(ax.transData, ax.transAxes)
    for point in failed:
        colour, marker = STYLES.get(point.method, OTHER)
        place = (point.wall, at) if point.wall else (1.0, ax.transAxes)
        ax.plot(
            [place[0]],
            [RAIL],
            color=colour,
            marker=marker,
            markerfacecolor="none",
            transform=place[1],
            clip_on=False,
        )
    for k, (line, colour) in enumerate(reasons(failed)):
        place = 0.01, 0.985 - 0.033 * k
        ax.text(*place, line, color=colour, transform=ax.transAxes, fontsize=6, va="top")
    if failed:
        ax.plot([0, 1], [RAIL] * 2, color="0.8", transform=ax.transAxes, clip_on=False, zorder=0)
        ax.text(-0.01, RAIL, "failed", transform=ax.transAxes, fontsize=7, ha="right", va="center")


def reasons(failed: list[Point]) -> list[tuple[str, str]]:
    """Lines about failures, with their colours."""
    groups: dict[tuple[str, str], int] = {}
    for p in failed:
        key = p.method, p.outcome.split("(")[0].split(":")[0].strip()
        groups[key] = groups.get(key, 0) + 1
    return [
        (f"{method} x{n}: {reason[:WORDS]}", STYLES.get(method, OTHER)[0])
        for (method, reason), n in groups.items()
    ]
