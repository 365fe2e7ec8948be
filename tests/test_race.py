"""tools/race.py: what it says of a motion, and of an engine that has none."""

from pathlib import Path

import numpy as np
import pytest

import warp_contact as wc

TOOLS = str(Path(__file__).resolve().parent.parent / "tools")


@pytest.fixture(autouse=True)
def tools(monkeypatch):
    """Import from tools/ as the tools do."""
    monkeypatch.syspath_prepend(TOOLS)


def blocks() -> wc.Scene:
    scene = wc.Scene()
    for size, z in ((0.1, 0.0), (0.06, 0.08)):
        scene.add_body(wc.box(size, 1), wc.NeoHookean(1e5, 0.3, 1000.0), (0.0, 0.0, z))
    return scene


def test_overlap_and_inverted_tets_are_counted():
    import race
    from engines.task import Motion, Task

    x = np.concatenate([body.x for body in blocks().bodies])
    deep, flat = x.copy(), x.copy()
    deep[8:, 2] -= 0.02  # the upper block, into the lower one
    flat[:8, 2] *= -1.0  # the lower block upside down, below the upper one
    motion = Motion(np.array([x, deep, flat]), np.zeros((3, 16, 3)), 1.0, 0.0, 3)
    deepest, last, inverted = race.look(Task(blocks, 60, 2), motion)
    finer = wc.box(0.06, 1)
    edge = np.linalg.norm(np.diff(finer.vertices[finer.edges], axis=1), axis=2).mean()
    assert deepest == pytest.approx(0.02 / edge, rel=1e-5)  # float32
    assert last == 0.0
    assert inverted == len(finer.tets)


def test_a_run_without_a_motion_gives_its_reason_and_time():
    import race
    from engines.task import Motion, Task

    motion = Motion(cpu=412.3, reason="too slow: 3 of 60 frames in 20 s")
    cells = race.cells(Task(blocks, 60, 2), motion)
    assert cells == ["", "412", "", "", "too slow: 3 of 60 frames in 20 s"]


def test_every_scene_of_the_race_can_be_built():
    import race

    for build, seconds, settings in race.RACES.values():
        assert len(build().bodies) > 1
        assert seconds > 0.0
        assert all(len(values) >= settings > 0 for values in race.SETTINGS.values())


def test_every_setting_has_a_value_for_each_knob():
    import race
    from engines import runs

    for engine, settings in runs.SWEEPS.items():
        rows = {tuple(setting.values()) for setting in settings}
        assert len(rows) == len(settings) == 10
        assert set(race.SETTINGS[engine]) <= set(range(10))
    assert set(race.SETTINGS) == set(runs.SWEEPS) == set(runs.ENGINES)
