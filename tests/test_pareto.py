"""tools/pareto.py: who dominates whom, and the rail of failures."""

from pathlib import Path

import pytest

TOOLS = str(Path(__file__).resolve().parent.parent / "tools")


@pytest.fixture(autouse=True)
def tools(monkeypatch):
    """Import from tools/ as the tools do."""
    monkeypatch.syspath_prepend(TOOLS)


def panel():
    from charting.panel import Panel

    import warp_contact as wc

    def build() -> wc.Scene:
        scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
        for k in range(2):
            mesh, rubber = wc.box(0.1, 1), wc.NeoHookean(1e5, 0.3, 1000.0)
            scene.add_body(mesh, rubber, (0.0, 0.0, 0.101 * k), velocity=(0.0, 0.0, -0.5 * k))
        return scene

    return Panel("A", "title", build, 240, 2, lambda panel, motion: 0.0, 1000.0)


def test_the_impulses_alone_move_no_surface(monkeypatch):
    from charting import methods, ours

    from warp_contact import solver

    calls = []
    monkeypatch.setattr(solver, "move_surfaces", lambda *args: calls.append(args))
    settings = {setting.method: setting for setting in methods.own(quick=True)[::-1]}
    ours.run(panel(), settings["impulses alone"], None, 60.0)
    assert calls == []
    ours.run(panel(), settings["default"], None, 60.0)
    assert calls != []


def test_steps_are_multiples_of_those_that_the_same_method_takes(monkeypatch):
    import pareto
    from charting import methods
    from charting.panel import Failed, Motion

    own = methods.own(quick=False)
    own.append(methods.Own("broken", factor=1))
    own.append(methods.Own("broken", factor=2))
    alike = dict.fromkeys((s.method, s.times) for s in own)
    alone = {key: 3 + 2 * k for k, key in enumerate(alike)}
    taken = {}

    def run(panel, setting, steps, limit):
        if setting.method == "broken":
            raise Failed("not finite")
        taken[setting] = steps
        return Motion(None, None, "", 1.0, 0.0, steps or alone[setting.method, setting.times])

    monkeypatch.setattr(methods, "own", lambda quick: own)
    monkeypatch.setattr(methods, "PEERS", {})
    monkeypatch.setattr(pareto.ours, "run", run)
    points = pareto.one(panel(), False, "", 1.0)
    for s, steps in taken.items():
        assert steps == (None if s.factor == 1 else s.factor * alone[s.method, s.times])
    assert [p.outcome for p in points if p.failed] == ["not finite", "no run with steps x1"]
    assert {s.factor for s in taken if s.method == "predicted"} == {1, 2, 4}


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
