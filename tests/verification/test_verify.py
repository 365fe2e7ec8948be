"""verify.py: its cases are there, its table, its exit status and its file."""

import csv
from importlib import import_module

import pytest
import verify
from verification import energy


@pytest.mark.parametrize("where", [where for _, where in verify.CASES.values()])
def test_every_case_has_a_function_that_yields_its_figures(where):
    file, function = where.split(".")
    assert callable(getattr(import_module(f"verification.{file}"), function))


def test_a_case_is_printed_written_and_held_to_its_target(monkeypatch, capsys, tmp_path):
    path = tmp_path / "energy.csv"
    arguments = ["verify.py", "energy", "--quick", "--csv", str(path)]
    monkeypatch.setattr("sys.argv", arguments)
    assert verify.main() == 0
    assert capsys.readouterr().out.endswith("damping: ok\n")
    rows = list(csv.DictReader(path.read_text().splitlines()[1:]))
    assert [row["level"] for row in rows] == ["ok"] * len(energy.RATIOS)

    monkeypatch.setattr(energy, "OFF", (1e-6,))  # per cent, of the decrement
    assert verify.main() == 1
    assert capsys.readouterr().out.endswith("damping: missed\n")
