"""tools/pareto.py: who dominates whom, the rail of failures, the distance of surfaces."""

from dataclasses import replace
from pathlib import Path

import numpy as np
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

    from warp_contact.step import step

    calls = []
    monkeypatch.setattr(step, "move_surfaces", lambda *args: calls.append(args))
    settings = {setting.method: setting for setting in methods.own(quick=True)[::-1]}
    ours.run(panel(), settings["impulses alone"], None, 60.0)
    assert calls == []
    ours.run(panel(), settings["default"], None, 60.0)
    assert calls != []


def test_held_vertices_stop_where_the_panel_says_so():
    from charting import methods, ours

    blocks = panel()

    def build():
        scene = blocks.scene()
        scene.bodies[1].fixed[:] = True
        return scene

    setting = next(s for s in methods.own(quick=True) if s.method == "default")
    motion = ours.run(replace(blocks, scene=build, frames=3, stop=1), setting, None, 60.0)
    z = motion.x[:, 8:, 2].mean(axis=1)
    assert z[0] - z[1] == pytest.approx(0.5 / 240, rel=1e-4)  # float32 positions of 0.1 m
    np.testing.assert_array_equal(z[1:], z[1])


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
    assert "of the default's front" not in text  # there is no default
    named = [replace(p, method="default") if p.method == "slow" else p for p in points()]
    text = words.report("head", {"A": "title"}, named)
    assert "than a point of the default's front: exact, between, equal\n" in text
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


def distance(xa, xb) -> float:
    """Of two surfaces of one triangle each."""
    from charting.distance import distance

    tri = np.array([[0, 1, 2]])
    return distance(np.array(xa), tri, np.array(xb), tri)


FLAT = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
PAIRS = {  # second triangle, distance from FLAT
    "a vertex above the inside": ([[0.2, 0.2, 0.3], [0.2, 1.0, 2.0], [1.0, 0.2, 2.0]], 0.3),
    "a vertex beside an edge": ([[0.5, -0.4, 0.0], [0.5, -2.0, 1.0], [0.6, -2.0, -1.0]], 0.4),
    "edges that pass each other": ([[0.5, -1.0, -0.9], [0.5, -1.0, 1.1], [0.5, -2.0, 0.0]], 1.0),
    "a crossed one above": ([[0.5, -0.5, 0.2], [0.5, 0.5, 0.2], [0.5, 0.0, 2.0]], 0.2),
    "parallel edges": ([[0.2, -0.3, 0.0], [0.8, -0.3, 0.0], [0.5, -1.0, 1.0]], 0.3),
    "one that goes through": ([[0.2, 0.2, 0.3], [0.2, 0.2, -0.3], [0.9, 0.9, 0.3]], 0.0),
    "one apart in its own plane": ([[3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [3.0, 1.0, 0.0]], 2.0),
}


@pytest.mark.parametrize("case", PAIRS)
def test_the_distance_of_two_triangles(case):
    other, exact = PAIRS[case]
    # Double precision on coordinates of order 1.
    assert distance(FLAT, other) == pytest.approx(exact, abs=1e-14)
    assert distance(other, FLAT) == pytest.approx(exact, abs=1e-14)


def test_the_distance_of_triangles_is_that_of_their_points(rng):
    weights = np.array([(i, j, 40 - i - j) for i in range(41) for j in range(41 - i)]) / 40.0
    for _ in range(20):
        a, b = rng.uniform(-1.0, 1.0, (2, 3, 3))
        sampled = np.linalg.norm((weights @ a)[:, None] - weights @ b, axis=2).min()
        exact = distance(a, b)
        # Each of the two nearest points has one of the samples within a cell, an edge over 40; no
        # edge is longer than the diagonal of the cube that they are drawn from.
        assert exact <= sampled + 1e-14
        assert exact >= sampled - 2.0 * np.sqrt(12.0) / 40.0


def held(heights) -> tuple:
    """The squeezed sphere with its upper cube at so many edges over the sphere, frame by frame."""
    from charting import panel as parts
    from charting import paper
    from charting.panel import Motion

    panel = paper.scene("squeezed_sphere", True)
    scene = panel.scene()
    x = np.concatenate([body.x for body in scene.bodies])
    x[parts.part(scene, 1), 2] -= distance_of(scene, 0, 1)
    unit = min(paper.edge(scene.bodies[k].mesh) for k in (1, 2))
    frames = np.repeat(x[None], panel.frames + 1, axis=0)
    top = parts.part(scene, 2)
    frames[:, top, 2] -= frames[0, top, 2].min() - frames[0, parts.part(scene, 1), 2].max()
    frames[:, top, 2] += unit * np.broadcast_to(heights, panel.frames + 1)[:, None]
    return panel, Motion(frames, np.zeros_like(frames), "neo-hookean", 1.0, 0.0, 1)


def distance_of(scene, *pair) -> float:
    from charting.distance import distance

    one, two = (scene.bodies[k] for k in pair)
    return distance(one.x, one.mesh.surface, two.x, two.mesh.surface)


def test_a_margin_is_an_error_like_an_overlap():
    for height in (0.1, -0.02):
        panel, motion = held(height)
        # Overlaps are measured in float32, on coordinates of ten edges.
        assert panel.error(panel, motion) == pytest.approx(abs(height), abs=1e-5)
        overlap, _ = panel.also
        assert overlap.error(overlap, motion) == pytest.approx(max(-height, 0.0), abs=1e-5)


def test_a_motion_is_judged_by_its_distance_from_a_converged_one():
    from charting import ours, paper
    from charting.methods import Own

    panel = paper.scene("squeezed_sphere", True)
    setting = Own("default", "balanced")
    motion = ours.run(panel, setting, None, np.inf)
    shown = panel.also[1]
    # 0.0016 was seen; another machine may round other contacts into being.
    assert 0.0 < shown.error(shown, motion) < 0.01
    edges = [paper.edge(body.mesh) for body in panel.scene().bodies]
    shift = np.array([0.0, 0.1 * np.mean(edges), 0.0])
    there = replace(motion, x=paper.converged(shown) + shift)
    # Positions are kept in float32, of bodies ten edges wide.
    assert shown.error(shown, there) == pytest.approx(0.1, abs=1e-5)


@pytest.mark.parametrize("name", ["squeezed_sphere", "cubes_on_membrane"])
def test_the_converged_motion_hardly_changes_with_half_the_steps(name):
    from charting import paper

    panel = paper.scene(name, True).also[1]
    half = paper.converged(panel, paper.CONVERGED // 2)
    change = paper.rms_distance(panel, paper.converged(panel), half)
    print(change)
    # 1.1e-4 and 0.7e-4 were seen; the figures that it is to judge begin at 1.6e-3.
    assert 0.0 < change < 5e-4


def test_bodies_that_went_through_each_other_are_a_failure():
    from charting.panel import Failed

    panel, motion = held(1.1)
    for shown in (panel, *panel.also):
        with pytest.raises(Failed, match=r"apart \(1\.1 edges\)"):
            shown.error(shown, motion)


def test_a_hop_is_no_gap_and_one_that_stays_is():
    hop = np.zeros(31)
    hop[-3:] = 0.1
    panel, motion = held(hop)
    # Rounding of coordinates of 0.3 m; overlaps are measured in float32.
    assert panel.error(panel, motion) == pytest.approx(0.0, abs=1e-5)
    hop[-6:] = 0.1
    panel, motion = held(hop)
    assert panel.error(panel, motion) == pytest.approx(0.1, abs=1e-5)


def test_every_pair_that_presses_is_in_its_scene():
    from charting import paper

    for name, pairs in paper.PRESSED.items():
        labels = {body.label for body in paper.scene(name, True).scene().bodies}
        assert {label for pair in pairs for label in pair} == labels
