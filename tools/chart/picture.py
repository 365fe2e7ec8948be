"""The pictures: error against CPU time, one panel each, failures on a rail at the top."""

from pathlib import Path

from matplotlib import rcParams
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import blended_transform_factory as blend

from chart.points import Point, front

rcParams["axes.labelsize"] = 12
STYLES = {  # method: (colour, marker, what a newcomer is told)
    "default": ("#c8401e", "o", "warp_contact, default"),
    "implicit": ("#d6559b", "*", "the same, implicit steps"),
    "impulses alone": ("#8a5a9e", "p", "its impulses alone"),
    "predicted": ("#3d9a93", "h", "predicted forces"),
    "literal": ("#e8a33d", "D", "the paper's search, as written"),
    "penalty": ("#7a7a7a", "v", "penalty forces"),
    "virtual": ("#a8925a", "<", "virtual contact surface"),
    "Newton VBD": ("#2060a8", "s", "Newton VBD"),
    "Newton XPBD": ("#5fa8d8", "^", "Newton XPBD"),
    "MuJoCo flex": ("#2f8a4a", "P", "MuJoCo flex"),
}
OTHER = "black", "x", "another"
SUMMARY = {  # panel: its title and what the error is, in the small picture
    "A3": "Hertz pressure\nerror of the pressure in the middle",
    "A7m": "Heavy on light\nerror of the force, of the weight",
    "squeezed_sphere": "Squeezed sphere: overlap or gap\noverlap or gap, of an edge",
    "cubes_on_membrane": "Cubes on a membrane: overlap or gap\noverlap or gap, of an edge",
}
SECONDS = "CPU seconds per simulated second"
TITLE = "Error against computing time, same meshes and masses for all; lower left is better"
FLOOR = 0.1  # an error of zero is drawn at this part of the smallest other one, and marked
RAIL = 1.035  # height of the rail, of the panel
FAINT = 0.25  # opacity of points that their own method beats


def draw(path: Path, titles: dict[str, str], points: list[Point]) -> None:
    """A picture of panels in two columns; ``titles``, and what the error is, by their names."""
    rows = -(-len(titles) // 2)
    figure = Figure(figsize=(14.0, 5.0 * rows), layout="constrained")
    axes = figure.subplots(rows, 2)
    for ax in axes.flat[len(titles) :]:
        ax.set_visible(False)
    for ax, (name, title) in zip(axes.flat, titles.items(), strict=False):
        panel(ax, title, [p for p in points if p.panel == name])
    handles = []
    for method in dict.fromkeys(p.method for p in points if p.panel in titles):
        colour, marker, label = STYLES.get(method, OTHER)
        handles.append(Line2D([], [], color=colour, marker=marker, ms=9.0, label=label))
    grey = {"color": "0.5", "marker": "o", "ls": ""}
    handles += [
        Line2D([], [], color="black", lw=6, alpha=0.12, label="the best of all"),
        Line2D([], [], alpha=2 * FAINT, label="off its line", **grey),
        Line2D([], [], mfc="none", label="failed", **grey),
    ]
    figure.suptitle(TITLE, fontsize=15)
    figure.legend(handles=handles, loc="outside lower center", ncols=5, fontsize=12, frameon=False)
    figure.savefig(path, dpi=100)


def panel(ax, title: str, points: list[Point]) -> None:
    """Points, the front of each method, that of all, and each failure on a rail at the top."""
    title, _, error = title.partition("\n")
    ax.set(xscale="log", yscale="log", xlabel=SECONDS, ylabel=error)
    ax.set_title(title, fontsize=15, pad=26)
    ax.xaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_major_formatter(lambda value, _: f"{100.0 * value:g} %")
    ax.tick_params(labelsize=11)
    ax.grid(True, which="major", color="0.9")
    errors = [p.error for p in points if p.error is not None]
    floor = FLOOR * min((e for e in errors if e > 0.0), default=1.0)
    if 0.0 in errors:
        ax.text(1.01, floor, "0", transform=blend(ax.transAxes, ax.transData), va="center")
    if None in (p.error for p in points):
        ax.plot([0, 1], [RAIL] * 2, color="0.8", transform=ax.transAxes, clip_on=False, zorder=0)
        style = {"transform": ax.transAxes, "fontsize": 10, "ha": "right", "va": "center"}
        ax.text(-0.01, RAIL, "failed", **style)

    def draw_all(draw, some: list[Point], **style) -> None:
        draw([p.cpu for p in some], [p.error or floor for p in some], **style)

    draw_all(ax.step, front(points), where="post", color="black", linewidth=6, alpha=0.12)
    for method in reversed(dict.fromkeys(p.method for p in points)):  # the default lies on top
        colour, marker, _ = STYLES.get(method, OTHER)
        mine = [p for p in points if p.method == method and p.error is not None]
        dots = {"color": colour, "marker": marker, "ls": "", "ms": 7.0}
        draw_all(ax.plot, mine, alpha=FAINT, **dots)
        draw_all(ax.plot, front(mine), **dots)
        draw_all(ax.step, front(mine), where="post", color=colour, linewidth=1.8)
        for p in points:
            if p.method == method and p.error is None:  # at its time, without one at the right end
                where = blend(ax.transData if p.cpu else ax.transAxes, ax.transAxes)
                ax.plot(p.cpu or 1.0, RAIL, transform=where, clip_on=False, mfc="none", **dots)
