"""A9: nothing is felt of the facets below a block that slides."""

import pytest
from verification import facets


@pytest.mark.parametrize("ratio", facets.RATIOS)
def test_a_block_slides_over_facets_without_feeling_them(ratio, ask, hold):
    hold(facets.drag(ask, ratio, fixed=True), "excellent")
