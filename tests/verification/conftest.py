"""The cases come from ``tools/``; what a test may ask of their figures."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))

from measure.figure import ORDER


@pytest.fixture
def hold():
    """``hold(figures, level, but={part of a name: level})``: every figure reaches its level."""

    def check(figures, level: str, but: dict[str, str] | None = None) -> dict[str, float]:
        found = list(figures)
        print(*found, sep="\n")
        judged = [f for f in found if f.level]
        assert judged, "nothing was judged"
        missed = []
        for f in judged:
            wanted = next((w for part, w in (but or {}).items() if part in f.name), level)
            if ORDER.index(f.level) > ORDER.index(wanted):
                missed.append(f"{f} (wanted: {wanted})")
        assert not missed, "\n" + "\n".join(missed)
        return {f.name: f.value for f in found}

    return check
