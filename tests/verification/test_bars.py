"""A4: impacts of elastic bars, and their orders of convergence."""

import pytest
from verification import bars, orders


@pytest.mark.parametrize("name", bars.IMPACTS)
def test_the_restitution_is_that_of_the_pressure_over_the_contact(name):
    impact = bars.IMPACTS[name]
    impulse = impact.pressure * impact.plateau
    gained = sum(impulse / (bar.density * bar.length) for bar in impact.bars)
    # The pressure stays for the plateau, then falls by the same factor at each return of the wave.
    steps = round(impact.contact / impact.plateau)
    factor = impact.left ** (1.0 / max(steps - 1, 1))
    gained *= sum(factor**k for k in range(steps))
    assert gained == pytest.approx((1.0 + impact.e) * impact.approach, rel=1e-4)


@pytest.mark.parametrize("name", bars.IMPACTS)
def test_bars_press_on_each_other_and_part_as_the_waves_say(name, hold):
    figures = list(bars.hit(name, bars.IMPACTS[name], bars.ELEMENTS))
    # target 2 % of the time, reached 2.7 % and -3.1 %: the dispersion of the mesh, see below
    part = {"end of the contact": "good"} if name in bars.UNEQUAL else {}
    best = dict.fromkeys(("pressure, mean", "largest pressure afterwards"), "best")
    found = hold(figures, "excellent", but=best | part)
    # Reached 0 to 6.2e-6, in flight before the impact (L2 = 2 L1): positions of 2 m in single
    # precision strain cells of 25 mm by up to 5e-6. Exact contact in double precision has none.
    assert found["rise of the energy [of that at the start]"] < 1.5e-5


@pytest.mark.parametrize("name", [name for name, i in bars.IMPACTS.items() if i.e < 1.0])
def test_unequal_bars_part_when_exact_contact_on_the_same_mesh_does(name):
    figures = list(bars.hit(name, bars.IMPACTS[name], bars.ELEMENTS))
    apart = next(f for f in figures if f.name.startswith("end, difference of both"))
    # Reached 0.019 %, 0.032 % and 0.051 % of 2 L / c; a step is 0.31 %, 0.1 % and 0.1 % of it.
    assert abs(apart.value) < 0.1


@pytest.mark.parametrize("name", bars.UNEQUAL)
def test_unequal_bars_of_many_elements_part_as_the_waves_say(name, hold):
    impact = bars.faster(bars.IMPACTS[name])
    hold(list(bars.hit(name, impact, bars.FINE)), "excellent")


def test_the_impact_converges_with_step_and_elements(hold):
    hold(orders.impact((10, 20, 40)), "excellent")


def test_no_step_changes_the_place_of_a_sliding_block(hold):
    hold(orders.sliding(), "excellent")


def test_an_error_that_does_not_fall_has_no_order():
    found = orders.order("", "", (1, 2, 4), [1.0, 0.2, 0.3], orders.PRESSURE)
    assert found.level == "missed"
    exact = orders.order("", "", (1, 2, 4), [1.0, 0.5, 0.25], orders.PRESSURE)
    assert exact.value == pytest.approx(1.0) and exact.level == "best"
