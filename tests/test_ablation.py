"""tools/ablation.py: a part is missed where its case gets worse, and is back afterwards."""

import math
import sys
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
import warp as wp

from warp_contact import NeoHookean, Scene, TetMesh, box
from warp_contact.data import switches
from warp_contact.frame import step_bounds, stepper
from warp_contact.kernels.impulse import constraint, tangent
from warp_contact.kernels.narrow_phase import edge_contact, vertex_contact
from warp_contact.step import search

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

import ablation
from ablation import PARTS, Part, number
from trials.parts import Case, Quantity

RUBBER = NeoHookean(1e5, 0.3, 1000.0)
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


def side(stages, find_contacts) -> float:
    """How much up a vertex is led that came in through the top of a cube, close to a side."""
    scene = Scene()
    scene.add_body(box(1.0, 2), RUBBER)
    tip = TetMesh([[0, 0, 0], [1.0, -0.3, 0.2], [1.0, 0.3, 0.2], [1.0, 0, 0.5]], [[0, 1, 2, 3]])
    scene.add_body(tip, RUBBER, (0.49, 0.15, 0.502))
    model, state, work = stages(scene)
    x = state.x.numpy().copy()
    x[-4:, 2] -= 0.052
    c = find_contacts(model, work, state.x, wp.array(x, dtype=wp.vec3), apart=True)
    (k,) = np.flatnonzero(c.vert[:, 0] == len(x) - 4)
    return float(c.normal[k, 2])


def end(stages, find_contacts) -> float:
    """How deep an edge is at its contact, in by the top of a cube and out by a side, 0.04 lower."""
    cube = box(1.0, 1)
    x = cube.vertices
    top = next(t for t in cube.surface if (x[t, 2] > 0.4).all() and (x[t, 0] > 0.4).sum() == 1)
    enter = np.where(x[top, 0] > 0.4, 0.8, np.where(x[top, 1] > 0.4, 0.13, 0.07)) @ x[top]
    leave = np.array([0.5, enter[1], 0.46])
    along = 4.0 * (leave - enter)
    away = [(0.9, enter[1] + aside, 2.0) for aside in (-0.3, 0.3)]
    scene = Scene()
    scene.add_body(cube, RUBBER)
    scene.add_body(TetMesh([enter - along, leave + along, *away], [[0, 1, 2, 3]]), RUBBER)
    model, state, work = stages(scene)
    c = find_contacts(model, work, state.x, edges=True)
    (k,) = (k for k in range(c.n) if set(c.vert[k, :2]) == {8, 9})
    return float(c.depth[k])


@pytest.mark.parametrize(
    ("name", "figure", "on", "off"), [("entry", side, 1.0, 0.0), ("deep end", end, 0.04, 0.02)]
)
def test_a_constant_of_a_kernel_is_another_one_and_then_the_same_again(
    name, figure, on, off, stages, find_contacts
):
    part = PARTS[name]
    before = figure(stages, find_contacts)
    with part.off():
        assert figure(stages, find_contacts) == pytest.approx(off, abs=1e-5)  # float32
    assert figure(stages, find_contacts) == before == pytest.approx(on, abs=1e-5)


@pytest.mark.parametrize(("name", "off"), [("edges", 1.0), ("closure", 0.1)])
def test_tilted_blocks_need_contacts_of_edges_and_the_closure(name, off):
    line = ablation.compare(PARTS[name])
    assert line.kept < 0.1  # the target of all collisions, tools/verification/collision.py
    # Without edges nothing keeps a corner out, which goes in by 5 % of an edge; without the closure
    # 0.2 % are left. Rounding in a collision moves that by far less than the factor to these.
    assert line.off > off
