"""tools/chart/growth.py: what is drawn of the times, and which runs count; implicit steps."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import warp_contact as wc

TOOLS = str(Path(__file__).resolve().parent.parent / "tools")


@pytest.fixture(autouse=True)
def tools(monkeypatch):
    """Import from tools/ as the tools do."""
    monkeypatch.syspath_prepend(TOOLS)


def test_times_grow_with_the_least_time_of_a_method_and_failures_stand_above(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    from chart import growth, picture
    from chart.points import Point

    drawn = []
    monkeypatch.setattr(picture.Figure, "savefig", lambda figure, *_, **__: drawn.append(figure))
    times = {"blocks 1e+08": (3.0, 2.0, None), "blocks 1e+09": (None, None, 5.0)}
    times["worlds 4"] = 1.0, 1.0, 1.0
    found = [
        Point(panel, method, "", cpu or 1.0, None if cpu is None else 0.0)
        for panel, of in times.items()
        for method, cpu in zip(("default", "default", "implicit"), of, strict=True)
    ]
    growth.draw(tmp_path / "growth.png", found)
    lines = [line.get_xydata().tolist() for line in drawn[0].axes[0].lines]
    assert lines[0][0] == [1e8, 2.0] and np.isnan(lines[0][1][1])
    assert [x for x, _ in lines[1]] == [1e9]
    assert lines[2][1] == [1e9, 5.0] and [x for x, _ in lines[3]] == [1e8]


def test_a_block_that_is_not_where_it_rests_does_not_count():
    from chart import growth
    from engines.task import Failed, Motion, Numbered

    task, (panel,) = growth.TASKS["blocks 1e+10"]
    x = np.repeat(Numbered(task.scene()).rest[None], task.frames + 1, axis=0)
    still = Motion(x, np.zeros_like(x), 1.0, 0.0, 1)
    assert panel.error(task, still) == 0.0  # both hang 1 and 2 mm too high: 0.07 edges
    for part in Numbered(task.scene()).parts:
        moved = x.copy()
        moved[1:, part, 2] += 0.002
        with pytest.raises(Failed, match="from its place"):
            panel.error(task, replace(still, x=moved))


def test_implicit_steps_are_as_many_as_asked_for_or_the_point_says_why_there_are_none():
    from chart import growth
    from engines import ours

    task, _ = growth.TASKS["blocks 1e+10"]
    assert ours.run(replace(task, frames=2), ours.IMPLICIT, 5, 60.0).steps == 5

    def fine():
        scene = wc.Scene()
        scene.add_body(wc.box(0.1, 9), wc.NeoHookean(1e5, 0.3, 1000.0))
        return scene

    motion = ours.run(replace(task, scene=fine), ours.IMPLICIT, None, 60.0)
    assert "'body0' has 1000 vertices, more than 800" in motion.reason
