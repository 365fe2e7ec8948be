"""tools/pareto.py: repeats of what is measured, engines that are not there."""

import importlib.util
import sys
from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def tools(monkeypatch):
    """Import from tools/ as the tools do."""
    monkeypatch.syspath_prepend(str(Path(__file__).resolve().parent.parent / "tools"))


def test_an_engine_that_is_not_installed_is_in_the_table_with_its_extra():
    from engines import runs
    from engines.task import Task

    from warp_contact import scenes

    if importlib.util.find_spec("mujoco"):
        pytest.skip("it is installed")
    (motion,) = runs.outside(
        Task(scenes.load("two_bodies").build, 60, 2), "MuJoCo flex", [{}], sys.executable, 60.0
    )
    assert "mujoco" in motion.reason and "pip install 'warp_contact[peers]'" in motion.reason


def test_repeats_of_a_point_are_one_with_the_median_of_their_times(tmp_path, monkeypatch):
    import pareto

    def sweep(measured, cases, *_, out):
        (out / pareto.FILE).touch()
        times = (3.0, 9.0, 5.0)
        return [[[c["name"], "m", "1", times[c["repeat"]], 0.1, "ok", 0.0]] for c in cases]

    monkeypatch.setattr(pareto.wc, "sweep", sweep)
    monkeypatch.setattr(pareto, "draw", lambda *_: None)
    monkeypatch.setattr("sys.argv", ["pareto.py", "A1", "A3", "--out", str(tmp_path)])
    assert pareto.main() == 0
    found = pareto.points.read(tmp_path / "pareto.csv")
    assert [(p.panel, p.cpu) for p in found] == [("A1", 5.0), ("A3", 5.0)]
    assert not (tmp_path / pareto.FILE).exists()
