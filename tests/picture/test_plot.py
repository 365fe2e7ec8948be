"""``warp-contact plot``: which curves are drawn of a run, and what is said of a damaged one."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from command_line import blocks, complaint

from warp_contact.command import cli
from warp_contact.picture import plot

LINE = {
    "frame": 0,
    "time": 0.0,
    "kinetic": 1.0,
    "elastic": 2.0,
    "gravitational": 7.0,
    "momentum": [0.0, 1.0, 2.0],
    "angular_momentum": [3.0, 4.0, 5.0],
    "overlap": 1e-4,
    "self_overlap": 0.0,
    "n_contacts": 8,
    "unheld": 0,
    "unsolved": 0,
    "forces": {},
}


def curves(kind: str, *lines: dict) -> dict[str, list]:
    """What a panel draws of frames that differ from ``LINE`` in the fields given."""
    found = plot.PANELS[kind][1]([LINE | line for line in lines])
    return {label: curve.tolist() for label, curve in found.items()}


def test_energies_add_up_to_the_sum_and_fall_from_where_the_run_began():
    found = curves("energy", {}, {"gravitational": 4.0, "kinetic": 3.5})
    assert found["gravitational"] == [0.0, -3.0]
    assert found["sum"] == [3.0, 2.5]


def test_a_pair_that_does_not_touch_has_no_force_and_the_strongest_comes_first():
    found = curves(
        "force",
        {"forces": {"a": {"b": 2.0}}},
        {"forces": {"a": {"c": 9.0}, "b": {"plane0": None}}},
    )
    assert list(found) == ["a and c", "a and b", "b and plane0"]
    assert found["a and b"] == [2.0, 0.0] and found["a and c"] == [0.0, 9.0]
    assert found["b and plane0"][0] == 0.0 and np.isnan(found["b and plane0"][1])


def test_momenta_have_three_components_each():
    assert curves("momentum", {}, {}) == {"x": [0.0, 0.0], "y": [1.0, 1.0], "z": [2.0, 2.0]}
    assert curves("spin", {}) == {"x": [3.0], "y": [4.0], "z": [5.0]}


def test_a_run_is_plotted_with_every_panel_or_those_asked_for(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    out = tmp_path / "out"
    command = ["run", blocks(tmp_path), "--out", str(out), "--set", "gap=0.0", "--quiet"]
    assert cli.main(command) == 0
    assert cli.main(["plot", str(out)]) == 0
    assert capsys.readouterr().out == f"{out / 'metrics.png'}\n"
    assert (out / "metrics.png").read_bytes().startswith(b"\x89PNG")
    drawing = tmp_path / "some.svg"
    assert cli.main(["plot", str(out), "--what", "force", "spin", "--out", str(drawing)]) == 0
    assert drawing.read_text().count('id="axes_') == 2
    assert cli.main(["plot", str(out), "--out", str(tmp_path / "a.txt"), "--quiet"]) == 1
    assert "txt" in capsys.readouterr().err
    assert cli.main(["plot", str(out), "--what", "colour"]) == 2


def test_more_pairs_than_have_a_name_are_drawn_and_counted():
    figure = pytest.importorskip("matplotlib.figure").Figure()
    ax = figure.subplots()
    pairs = {f"a and b{k}": np.full(2, 20.0 - k) for k in range(plot.STRONGEST + 3)}
    plot.draw(ax, np.arange(2.0), pairs)
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert len(ax.lines) == plot.STRONGEST + 3
    assert texts == [*list(pairs)[: plot.STRONGEST], "3 weaker pairs"]


def test_a_torn_last_line_is_left_out_and_a_damaged_one_is_named(tmp_path, capsys):
    path = tmp_path / plot.METRICS
    whole = json.dumps(LINE) + "\n"
    path.write_text(whole + whole[:40])
    assert len(plot.read_metrics(tmp_path)) == 1
    for text, words in (
        (whole + whole[:40] + "\n", "line 2 is not one of a run"),
        (whole + "[1]\n", "line 2"),
        (json.dumps(LINE | {"momentum": 3.0}) + "\n", "line 1"),
        (whole[:9], "holds no frame"),
    ):
        path.write_text(text)
        assert cli.main(["plot", str(path)]) == 1
        assert words in complaint(capsys)
    assert cli.main(["plot", str(tmp_path / "nothing")]) == 2
    assert "no such file" in complaint(capsys)


def test_without_matplotlib_its_extra_is_named(tmp_path, capsys, monkeypatch):
    (tmp_path / plot.METRICS).write_text(json.dumps(LINE) + "\n")
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert cli.main(["plot", str(tmp_path)]) == 1
    assert "pip install 'warp_contact[plot]'" in complaint(capsys)
