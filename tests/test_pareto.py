"""tools/pareto.py: who dominates whom, and the rail of failures."""

from pathlib import Path

import pytest

TOOLS = str(Path(__file__).resolve().parent.parent / "tools")


@pytest.fixture(autouse=True)
def tools(monkeypatch):
    """Import from tools/ as the tools do."""
    monkeypatch.syspath_prepend(TOOLS)


def points():
    from charting.result import Point

    return [
        Point("A", "quick", "1", 1.0, 1e-1),
        Point("A", "exact", "1", 10.0, 1e-4),
        Point("A", "between", "1", 3.0, 1e-2),
        Point("A", "slow", "1", 10.0, 1e-2),
        Point("A", "equal", "1", 3.0, 1e-2),
        Point("A", "broken", "1", 0.1, None, "not finite"),
        Point("A", "absent", "1", None, None, "not installed"),
    ]


def test_the_front_is_what_no_other_point_beats_in_both():
    from charting.front import dominates, front

    p = {point.method: point for point in points()}
    assert [q.method for q in front(points())] == ["quick", "between", "equal", "exact"]
    assert dominates(p["between"], p["slow"]) and dominates(p["exact"], p["slow"])
    assert not dominates(p["quick"], p["exact"]) and not dominates(p["exact"], p["quick"])
    assert not dominates(p["between"], p["equal"])


def test_a_failure_is_behind_everything_and_on_no_front():
    from charting.front import dominates, fastest_below, front

    *fine, broken, absent = points()
    assert all(dominates(p, broken) and not dominates(broken, p) for p in fine)
    assert front([broken, absent]) == []
    assert fastest_below([broken, *fine], 1e-2).method == "between"
    assert fastest_below([broken], 1.0) is None


def test_the_table_keeps_every_point(tmp_path):
    from charting import result

    result.write(tmp_path / "points.csv", points())
    assert result.read(tmp_path / "points.csv") == points()


def test_words_and_picture_keep_every_failure(tmp_path):
    from charting import words

    text = words.report("head", {"A": "title"}, points())
    assert "failed: broken, 1 of 1: not finite" in text
    assert "failed: absent, 1 of 1: not installed" in text
    assert "behind the front: slow" in text
    pyplot = pytest.importorskip("matplotlib.pyplot")
    from charting import plot

    figure, ax = pyplot.subplots()
    plot.panel(ax, "title", points())
    on_rail = [line for line in ax.lines if list(line.get_ydata()) == [plot.RAIL]]
    assert len(on_rail) == 2
    assert {line for line, _ in plot.reasons(points()[-2:])} == {
        "broken x1: not finite",
        "absent x1: not installed",
    }
    pyplot.close(figure)
