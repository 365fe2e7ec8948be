"""tools/stability.py map: cells within the frontier, the frontier, the picture."""

import sys
from functools import partial
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

import stability
import trials
from trials import loads, outcome, sweeps
from trials.outcome import classify
from trials.watch import METHODS, attempt

# Maps go on to blocks that their own weight crushes.
pytestmark = pytest.mark.filterwarnings("ignore:body .* crushes it:UserWarning")

CELLS = {
    "step 3e-4 s, E 1e5": ("step", 3e-4, 1e5),
    "step 1e-3 s, E 1e4": ("step", 1e-3, 1e4),
    "mass 1e2, stiffness 1e2": ("ratio", 1e2, 1e2),
    "mass 1e4, stiffness 1e-2": ("ratio", 1e4, 1e-2),
    "overlap 0.03, thickness 0.07": ("depth", 0.03, 0.07),
    "overlap 0.3, thickness 0.4": ("depth", 0.3, 0.4),
    "0.5 m/s, step 3e-4 s": ("speed", 0.5, 3e-4),
}


@pytest.mark.parametrize("name", CELLS)
def test_a_cell_within_the_frontier_is_fine(name):
    sweep, x, y = CELLS[name]
    r = attempt(partial(sweeps.SWEEPS[sweep].build, x, y), most_steps=1500)
    assert classify(r) == outcome.FINE, r
    assert r.touched


@pytest.mark.parametrize(("moduli", "want"), [(16.0, outcome.FINE), (40.0, outcome.INVERTED)])
def test_a_block_carries_16_of_its_moduli_and_not_40_with_a_contact_and_without(moduli, want):
    """What limits the map of ratios at its lower rim is the material."""
    alone = attempt(partial(loads.own_weight, moduli))
    on_another = attempt(partial(sweeps.SWEEPS["ratio"].build, moduli, 1e-4))
    print(alone.volume, on_another.volume)
    assert classify(alone) == classify(on_another) == want


def test_the_map_writes_a_row_per_cell_and_a_picture(tmp_path, monkeypatch):
    maps = pytest.importorskip("trials.maps")
    monkeypatch.setattr(maps, "METHODS", METHODS[:2])
    monkeypatch.setattr(sweeps, "CELLS", 2)
    maps.draw(["speed"], tmp_path)
    rows = (tmp_path / "map.csv").read_text().splitlines()
    assert len(rows) == 1 + 2 * 4
    assert (tmp_path / "speed.png").stat().st_size > 1000


def test_without_matplotlib_the_map_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.delitem(sys.modules, "trials.maps", raising=False)
    monkeypatch.delattr(trials, "maps", raising=False)
    monkeypatch.setattr(
        sys, "argv", ["stability.py", "map", "speed", "--out", str(tmp_path / "map")]
    )
    assert stability.main() == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "map").exists()


def test_every_mass_and_stiffness_ratio_of_a_coarse_map_is_fine(monkeypatch):
    monkeypatch.setattr(sweeps, "CELLS", 5)
    s = sweeps.SWEEPS["ratio"]
    xs, ys = s.axes()
    found = {(x, y): attempt(partial(s.build, x, y), most_steps=600) for x in xs for y in ys}
    assert {cell: r for cell, r in found.items() if classify(r) != outcome.FINE} == {}
