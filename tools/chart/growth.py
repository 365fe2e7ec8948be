"""How time grows: with the stiffness of two blocks, and with the number of worlds.

The blocks are those of ``tools/integrators.py``, from 1e5 Pa on, as softer ones spring off; worlds
are copies of the squeezed sphere. A run counts where no overlap is deeper than ``MOST`` edges and
no block ends further from its place; of an engine the fastest setting that counts is drawn.
"""

from functools import partial
from pathlib import Path

import numpy as np
from clock.scenes import copies
from engines import ours
from engines.runs import SWEEPS
from engines.task import Failed, Motion, Task
from integrators import blocks
from verification.setup import G, mean_edge

from chart.panel import Panel, late, sound
from chart.points import Point
from chart.scenes import FPS, overlaps

MOST = 0.1
FIRM = {"Newton VBD": (2, 4, 7), "Newton XPBD": (1, 3), "MuJoCo flex": (1, 4, 7)}  # rows that may
OTHERS = {engine: [SWEEPS[engine][k] for k in rows] for engine, rows in FIRM.items()}


def deepest(task: Task, motion: Motion) -> float:
    """Overlap after any frame, in edges; ``Failed`` beyond ``MOST`` and where tets end inverted."""
    sound(task, motion)
    worst = max(overlap for overlap, _ in overlaps(task, motion))
    if worst > MOST:
        raise Failed(f"bodies inside each other ({worst:.2g} edges)")
    return worst


def settled(task: Task, motion: Motion) -> float:
    """As ``deepest``; ``Failed`` as well where a middle ends elsewhere than that of a linear bar.

    Both blocks close their gaps, and sink by 5/6 and 11/6 of r g L^2 / E under the weights.
    """
    worst, (body, _) = deepest(task, motion), task.scene().bodies
    rubber, size = body.material, np.ptp(body.x[:, 2])
    sunk = rubber.density * G * size**2 / rubber.youngs_modulus
    z = np.array([motion.x[:, part, 2].mean(axis=1) for part in sound(task, motion).parts])
    fall = z[:, 0] - z[:, late(task)].mean(axis=1)
    off = np.abs(fall - [1e-3 + 5.0 / 6.0 * sunk, 2e-3 + 11.0 / 6.0 * sunk]).max()
    if off > MOST * mean_edge(body.mesh):
        raise Failed(f"a block ends {off / mean_edge(body.mesh):.2g} edges from its place")
    return worst


KINDS = {  # first word of a panel: title, x-axis and its values, scene, frames, error
    "blocks": ("A block falls by 1 mm onto another", "Young's modulus of both [Pa]")
    + ([10.0**k for k in range(5, 13)], blocks, 24, settled),
    "worlds": ("Squeezed spheres in worlds of their own", "worlds")
    + ([1, 4, 16, 64, 256], copies, 12, deepest),
}
TASKS, WHO = {}, {}  # by the name of the panel; in worlds there is this package alone
for kind, (title, along, values, build, frames, error) in KINDS.items():
    for x in values:
        panel = Panel(f"{kind} {x:g}", f"{title}; {along}: {x:g}\ndeepest overlap [edges]", error)
        TASKS[panel.name] = Task(partial(build, x), FPS, frames), [panel]
        WHO[panel.name] = [ours.DEFAULT, ours.IMPLICIT], OTHERS if kind == "blocks" else {}


def draw(path: Path, points: list[Point]) -> None:
    """One picture of both panels; who has failed stands in a row above."""
    from chart import picture  # matplotlib: the table needs none

    figure = picture.Figure(figsize=(14.0, 6.5), layout="constrained")
    for ax, (kind, (title, along, *_)) in zip(figure.subplots(1, 2), KINDS.items(), strict=True):
        ax.set(xscale="log", yscale="log", xlabel=along, ylabel=picture.SECONDS)
        ax.set_title(title, fontsize=15, pad=60)
        ax.yaxis.set_major_formatter("{x:g}")
        ax.grid(True, which="major", color="0.9")
        mine = [p for p in points if p.panel.startswith(kind)]
        for row, method in enumerate(dict.fromkeys(p.method for p in mine)):
            colour, marker, label = picture.STYLES[method]
            style = {"color": colour, "marker": marker, "ms": 8.0, "clip_on": False}
            best = {}  # the least time, nan where every setting has failed
            for p in (p for p in mine if p.method == method):
                x, cpu = float(p.panel.split()[1]), np.nan if p.error is None else p.cpu
                best[x] = np.fmin(best.get(x, np.nan), cpu)
            ax.plot(*zip(*best.items(), strict=True), label=label, **style)
            lost = [x for x, cpu in best.items() if np.isnan(cpu)]
            if lost:  # an empty line would spoil the layout
                style["transform"] = picture.blend(ax.transData, ax.transAxes)
                ax.plot(lost, [1.03 + 0.03 * row] * len(lost), ls="", mfc="none", **style)
                ax.text(-0.01, 1.02 + 0.03 * row, "failed", transform=ax.transAxes, ha="right")
        ax.legend(fontsize=11, frameon=False)
    figure.savefig(path, dpi=100)
