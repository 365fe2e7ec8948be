"""A9: nothing is felt of the facets below a block that slides."""

import numpy as np
import pytest
import warp as wp
from verification import facets

from warp_contact.kernels.narrow_phase.contact import Contact


@pytest.mark.parametrize("ratio", facets.RATIOS)
def test_a_block_slides_over_facets_without_feeling_them(ratio, hold):
    hold(facets.drag(ratio, fixed=True), "excellent")


@pytest.mark.parametrize("ratio", facets.RATIOS)
def test_without_weights_the_force_jumps_while_a_block_slides(ratio):
    found = list(facets.compare(ratio))
    print(*found, sep="\n")
    ripple = [f for f in found if f.name.startswith("ripple of the normal")]
    on, off = ripple[0], ripple[1:]
    assert on.level in ("best", "excellent")
    assert [f.case.split(", ")[1] for f in off] == ["closest vertex"]
    # Measured 4 to 15 times; the rest leaves room for another order of rounding.
    assert all(f.value > 2.5 * on.value for f in off)
    jump = [f.value for f in found if f.name.startswith("largest jump")]
    # The whole force of a contact against what it shifts in a frame: measured 1.7 to 4 times.
    assert min(jump[1:]) > 1.3 * jump[0]


def test_without_weights_contacts_of_vertices_are_on_the_closest_vertex():
    records = np.zeros(3, dtype=Contact.numpy_dtype())
    records["coef"] = [[1.0, 0.0, -0.2, -0.5, -0.3], [1.0, 0.0, 0.0, 0.0, 0.0], [0.0] * 5]
    records["pair"] = [[0, 1], [0, 2], [0, 1]]  # the second is on a plane
    contacts = wp.array(records, dtype=Contact)
    wp.launch(facets.level, 3, inputs=[2, wp.array([3], dtype=int)], outputs=[contacts])
    want = [[1.0, 0.0, 0.0, -1.0, 0.0], *records["coef"][1:]]
    np.testing.assert_allclose(contacts.numpy()["coef"], want, rtol=1e-6)
