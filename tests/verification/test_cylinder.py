"""A3: Hertz's line contact."""

import numpy as np
import pytest
from verification import hertz
from verification.setup import Pose


def test_the_closed_form_meets_the_numbers_of_a_public_benchmark():
    """A cylinder of 50 mm on a block, 70 and 210 GPa, 35 kN/mm: 6.21 mm, 3585 MPa (NAFEMS)."""
    e_star = hertz.modulus(70e9, 210e9)
    # Three digits of the half-width and four of the pressure are published.
    half_width, peak = hertz.line_contact(35e6, 0.05, e_star)
    assert half_width == pytest.approx(6.21e-3, rel=1e-3)
    assert peak == pytest.approx(3585e6, rel=2e-4)


def test_the_pressure_over_the_half_width_is_the_force():
    load, radius, e_star = 100.0, 0.1, 1e6
    b, p0 = hertz.line_contact(load, radius, e_star)
    assert 0.5 * np.pi * b * p0 == pytest.approx(load)


@pytest.mark.parametrize("n", hertz.COUNTS)
def test_a_slice_has_the_elements_asked_for_and_lies_on_its_cylinder(n):
    size = 0.003 / n
    mesh = hertz.slab(size, hertz.COLUMNS[n])
    x, y, z = mesh.vertices.T
    columns = np.unique(np.round(x, 9))
    assert len(columns) == 2 * hertz.COLUMNS[n] + 1
    # The slope of sinh at 0, against its secant over a step.
    assert columns[columns > 0.0].min() == pytest.approx(size, rel=0.06)
    low = np.array([z[np.round(x, 9) == c].min() for c in columns])
    np.testing.assert_allclose(np.hypot(columns, hertz.RADIUS - low), hertz.RADIUS, rtol=1e-7)
    assert np.ptp(y) == pytest.approx(hertz.ACROSS * size)
    assert mesh.volumes.min() > 0.0


@pytest.mark.parametrize("n", [1, 2])
def test_a_cylinder_presses_on_a_plane_as_hertz_says(n, hold):
    # target the error of an exact active set. The half-width is read from n rows a side and errs
    # by 5 and 6 %; with elements 7 % shorter or longer by 1 to 13 %: the outer row holds or not.
    hold(hertz.line_on_plane(n, Pose()), "excellent", but={"half-width": "good"})


def test_a_turned_cylinder_with_four_elements_has_the_pressure_of_hertz(hold):
    hold(hertz.line_on_plane(4, Pose(True)), "excellent", but={"half-width": "good"})
