"""The pictures: error against wall time, one panel each, failures on a rail at the top."""

from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.lines import Line2D
from matplotlib.transforms import blended_transform_factory as blend

from chart.points import Point, front

STYLES = {  # method: (colour, marker, what a newcomer is told)
    "default": ("#c8401e", "o", "warp_contact, default"),
    "impulses alone": ("#8a5a9e", "p", "its impulses alone"),
    "predicted": ("#3d9a93", "h", "predicted forces"),
    "literal": ("#e8a33d", "D", "the paper's search, as written"),
    "penalty": ("#7a7a7a", "v", "penalty forces"),
    "Newton VBD": ("#2060a8", "s", "Newton VBD"),
    "Newton XPBD": ("#5fa8d8", "^", "Newton XPBD"),
    "MuJoCo flex": ("#2f8a4a", "P", "MuJoCo flex"),
}
SUMMARY = {  # panel: its title and what the error is, in the small picture
    "A3": ("Hertz pressure", "error of the pressure in the middle"),
    "A7m": ("Heavy on light", "error of the force, of the weight"),
    "squeezed_sphere": ("Squeezed sphere: overlap or gap", "overlap or gap, of an edge"),
    "cubes_on_membrane": ("Cubes on a membrane: overlap or gap", "overlap or gap, of an edge"),
}
TIME = "wall seconds per simulated second"
FLOOR = 0.1  # an error of zero is drawn at this part of the smallest other one, and marked
WORDS = 34  # characters of a reason


@dataclass(frozen=True)
class Look:
    """How a panel is drawn.

    Attributes:
        rail: height of the rail of failures, of the panel
        title: size of the title
        marker: size of a marker
        faint: opacity of points that their own method beats
        reasons: whether to say why runs failed
    """

    rail: float = 1.06
    title: int = 10
    marker: float = 5.0
    faint: float = 1.0
    reasons: bool = True


def draw(path: Path, titles: dict[str, str], points: list[Point]) -> None:
    """All panels in two columns; ``titles`` by the name of the panel."""
    rows = -(-len(titles) // 2)
    figure, axes = plt.subplots(rows, 2, figsize=(14.0, 5.6 * rows), layout="constrained")
    for ax in axes.flat[len(titles) :]:
        ax.set_visible(False)
    for ax, (name, title) in zip(axes.flat, titles.items(), strict=False):
        panel(ax, title, _of(points, name))
    known = {m: m for m in dict.fromkeys(p.method for p in points)}
    handles = [*_legend(known), Line2D([], [], color="black", lw=6, alpha=0.12, label="front")]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def draw_summary(path: Path, points: list[Point]) -> None:
    """The four panels of ``SUMMARY``, on one screen, without the reasons of failures."""
    look = Look(rail=1.035, title=15, marker=7.0, faint=0.25, reasons=False)
    figure, axes = plt.subplots(2, 2, figsize=(14.0, 10.0), layout="constrained")
    for ax, (name, (title, error)) in zip(axes.flat, SUMMARY.items(), strict=True):
        panel(ax, title, _of(points, name), look)
        ax.set_xlabel(TIME, fontsize=12)
        ax.set_ylabel(error, fontsize=12)
        ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        ax.yaxis.set_major_formatter(lambda value, _: f"{100.0 * value:g} %")
        ax.tick_params(labelsize=11)
    known = {p.method for p in points}
    handles = _legend({m: style[2] for m, style in STYLES.items() if m in known}, 9.0)
    handles += [
        Line2D([], [], color="black", lw=6, alpha=0.12, label="the best of all"),
        Line2D([], [], color="0.5", marker="o", ls="", alpha=2 * look.faint, label="off its line"),
        Line2D([], [], color="0.5", marker="o", ls="", mfc="none", label="failed"),
    ]
    title = "Error against computing time, same meshes and masses for all; lower left is better"
    figure.suptitle(title, fontsize=15)
    figure.legend(handles=handles, loc="outside lower center", ncols=6, fontsize=12, frameon=False)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def panel(ax, title: str, points: list[Point], look: Look = Look()) -> None:
    """Points, the front of each method, that of all, and the rail."""
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_title(title, fontsize=look.title, pad=42 if look.reasons else 26)
    ax.set_xlabel(TIME)
    ax.set_ylabel("error")
    ax.grid(True, which="major", color="0.9")
    fine = [p for p in points if not p.failed]
    floor = FLOOR * min((p.error for p in fine if p.error > 0.0), default=1.0)
    _curve(ax, front(points), floor, color="black", linewidth=6, alpha=0.12)
    for method in reversed(dict.fromkeys(p.method for p in points)):  # the default lies on top
        colour, marker = _style(method)
        mine = [p for p in fine if p.method == method]
        ahead = front(mine)
        style = {"color": colour, "marker": marker, "ls": "", "markersize": look.marker}
        for alpha, some in ((look.faint, mine), (1.0, ahead)):
            ax.plot([p.wall for p in some], [p.error or floor for p in some], alpha=alpha, **style)
        _curve(ax, ahead, floor, color=colour, linewidth=1.0 if look.reasons else 1.8)
    if any(p.error == 0.0 for p in fine):
        ax.text(1.01, floor, "0", transform=blend(ax.transAxes, ax.transData), va="center")
    rail(ax, [p for p in points if p.failed], look)


def rail(ax, failed: list[Point], look: Look) -> None:
    """Each failure above the panel, at its time or, where it has none, at the right end.

    Equal reasons of a method are said once, with their count.
    """
    if not failed:
        return
    at = blend(ax.transData, ax.transAxes)
    for point in failed:
        colour, marker = _style(point.method)
        x, where = (point.wall, at) if point.wall else (1.0, ax.transAxes)
        style = {"color": colour, "marker": marker, "mfc": "none", "ms": look.marker}
        ax.plot([x], [look.rail], transform=where, clip_on=False, **style)
    for k, (line, colour) in enumerate(reasons(failed) if look.reasons else ()):
        place = 0.01, 0.985 - 0.033 * k
        ax.text(*place, line, color=colour, transform=ax.transAxes, fontsize=6, va="top")
    ax.plot([0, 1], [look.rail] * 2, color="0.8", transform=ax.transAxes, clip_on=False, zorder=0)
    style = {"fontsize": 0.7 * look.title, "ha": "right", "va": "center"}
    ax.text(-0.01, look.rail, "failed", transform=ax.transAxes, **style)


def reasons(failed: list[Point]) -> list[tuple[str, str]]:
    """Lines about failures, with their colours."""
    groups: dict[tuple[str, str], int] = {}
    for p in failed:
        key = p.method, p.outcome.split("(")[0].split(":")[0].strip()
        groups[key] = groups.get(key, 0) + 1
    return [
        (f"{method} x{n}: {reason[:WORDS]}", _style(method)[0])
        for (method, reason), n in groups.items()
    ]


def _of(points: list[Point], panel: str) -> list[Point]:
    return [p for p in points if p.panel == panel and p.shown]


def _style(method: str) -> tuple[str, str]:
    return STYLES.get(method, ("black", "x", ""))[:2]


def _legend(labels: dict[str, str], size: float = 6.0) -> list[Line2D]:
    """A line for each method, with what it is called."""
    styles = {method: _style(method) for method in labels}
    return [
        Line2D([], [], color=colour, marker=marker, markersize=size, label=labels[method])
        for method, (colour, marker) in styles.items()
    ]


def _curve(ax, ahead: list[Point], floor: float, **style) -> None:
    """The best a method, or all of them, reach within a time."""
    ax.step([p.wall for p in ahead], [p.error or floor for p in ahead], where="post", **style)
