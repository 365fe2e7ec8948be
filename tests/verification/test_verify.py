"""verify.py: its cases are there, its table and its exit status."""

from importlib import import_module

import pytest
import verify
from verification import energy


@pytest.mark.parametrize("where", [where for _, where in verify.CASES.values()])
def test_every_case_has_a_function_that_yields_its_figures(where):
    file, function = where.split(".")
    assert callable(getattr(import_module(f"verification.{file}"), function))


def test_a_case_is_printed_and_held_to_its_target(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["verify.py", "energy", "--quick"])
    assert verify.main() == 0
    out = capsys.readouterr().out
    assert out.endswith("damping: ok\n")
    rows = [line for line in out.splitlines() if line.startswith("energy ")]
    assert len(rows) == len(energy.RATIOS) and all(row.endswith(" ok") for row in rows)

    monkeypatch.setattr(energy, "OFF", (1e-6,))  # per cent, of the decrement
    assert verify.main() == 1
    assert capsys.readouterr().out.endswith("damping: missed\n")
