"""tools/ablation.py: a part is missed where its case gets worse, and is back afterwards."""

import math
import sys
from pathlib import Path
from unittest import mock

import pytest

from warp_contact.data import switches
from warp_contact.frame import step_bounds, stepper
from warp_contact.kernels.impulse import constraint, tangent
from warp_contact.kernels.narrow_phase import edge_contact, vertex_contact
from warp_contact.step import search

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

import ablation
from ablation import PARTS, Part, number
from trials.parts import Case, Quantity

OWNERS = constraint, edge_contact, search, step_bounds, stepper, tangent, vertex_contact


@pytest.fixture
def part():
    """A part of which a figure depends on a bound: ``part(with, without, least)``."""

    def make(kept: float, off: float, least: float = 0.0) -> Part:
        figure, bound = Quantity("figure", least), search.SEARCH_BOUND
        case = Case("case", figure, lambda: kept if search.SEARCH_BOUND == bound else off)
        return Part("name", number(search, "SEARCH_BOUND", 1.0), case)

    return make


def test_a_part_is_worth_what_is_worse_without_it(part):
    assert ablation.compare(part(2.0, 6.0)).ratio == 3.0
    assert ablation.compare(part(2.0, 6.0)).worth
    assert not ablation.compare(part(2.0, 2.5)).worth
    assert not ablation.compare(part(6.0, 2.0)).worth


def test_what_is_below_the_least_does_not_count(part):
    assert ablation.compare(part(1e-9, 1e-6, least=1e-3)).ratio == 1.0
    assert ablation.compare(part(0.0, 5e-3, least=1e-3)).ratio == 5.0


@pytest.mark.parametrize("off", [math.inf, math.nan])
def test_a_figure_that_is_not_finite_is_worse_than_any(part, off):
    assert ablation.compare(part(1.0, off)).ratio == math.inf


def test_a_run_that_stops_early_is_worse_than_any(part):
    from warp_contact import SimulationError

    run = mock.Mock(side_effect=[1.0, SimulationError("not finite")])
    case = Case("case", Quantity("figure", 0.0), run)
    stops = Part("name", number(search, "SEARCH_BOUND", 1.0), case)
    assert ablation.compare(stops).ratio == math.inf


def test_the_exit_status_tells_of_a_part_that_nothing_misses(part, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["ablation.py"])
    monkeypatch.setattr(ablation, "PARTS", {"needed": part(1.0, 2.0)})
    assert ablation.main() == 0
    assert "To be removed" not in capsys.readouterr().out
    monkeypatch.setitem(ablation.PARTS, "idle", part(1.0, 1.0))
    assert ablation.main() == 1
    assert "To be removed: name." in capsys.readouterr().out


def off() -> list[str]:
    """Names of the parts that are switched off."""
    return [name for name in switches.PARTS if not switches.on(name)]


def test_every_part_changes_something_and_is_back_afterwards():
    before = [dict(vars(owner)) for owner in OWNERS]
    for part in PARTS.values():
        with part.off():
            changed = [dict(vars(owner)) for owner in OWNERS] != before
            assert changed or len(off()) == 1, part.name
        assert [dict(vars(owner)) for owner in OWNERS] == before
        assert off() == []


def test_every_switch_of_the_package_is_in_the_table():
    switched = set()
    for part in PARTS.values():
        with part.off():
            switched |= set(off())
    assert switched == set(switches.PARTS)


def test_a_switch_is_refused_where_there_is_no_such_part_or_it_is_off():
    with pytest.raises(KeyError):
        switches.on("nothing")
    with switches.without("edges"), pytest.raises(ValueError), switches.without("edges"):
        pass
    assert switches.on("edges")


@pytest.mark.parametrize("name", ["entry", "deep end"])
def test_a_constant_of_a_kernel_is_another_one_and_then_the_same_again(name):
    part = PARTS[name]
    before = part.case.run()
    with part.off():
        without_it = part.case.run()
    print(before, without_it)
    # 1 % of an edge was seen, and 0.26 %, each at one place and in many frames.
    assert before < 0.1 < without_it
    assert part.case.run() == before


def test_tilted_blocks_need_contacts_of_edges():
    line = ablation.compare(PARTS["edges"])
    assert line.kept < 0.1  # the target of all collisions, tools/verification/collision.py
    # Without edges nothing keeps a corner out; it goes in by 5 % of an edge, and rounding in a
    # collision moves that by far less than the factor of 5 that is left here.
    assert line.off > 1.0
