"""All lengths that are parts of a mean edge, in one table, with the reason of each.

Tolerances of contact depend on the mesh: a length that is negligible on a coarse body is not on a
fine one. All are parts [-] of the mean edge of a body, or of the shortest one of its world
where it says so.
"""

import warp as wp

# Gaps and overlaps, from the smallest.
FLUSH = wp.constant(1.0e-5)  # a vertex this deep lies in the surface
BOX_GROWTH = wp.constant(1.0e-5)  # rays must not miss the box of a flat triangle
IMPULSE_TOLERANCE = wp.constant(1.0e-5)  # a smaller approach in a step is left to the closure
NEGLIGIBLE = wp.constant(0.1 * 1.0e-5)  # of the shortest edge: less does not affect other contacts
CLOSURE_TOLERANCE = wp.constant(1.0e-4)  # a smaller overlap is left to the resting gap
REST_GAP = wp.constant(2.0e-4)  # resting gap: rounding does not decide which vertex is inside
FLUSH_EDGE = wp.constant(2.0e-4)  # an edge this deep lies in the face, whatever its direction
VERTEX_MARGIN = wp.constant(1.0e-3)  # speculative: a vertex this close makes a contact with a gap
SELF_DEEP = wp.constant(1.0e-3)  # a body overlaps itself by more: rounding puts no vertex so deep
OLD_OVERLAP = wp.constant(1.0e-3)  # at the start of a step: a deeper one is for the search
SAME_PLACE = wp.constant(1.0e-3)  # surfaces closer than this show no overlap to search
STALE_OVERLAP = wp.constant(2.0e-3)  # at the start of a step: a deeper one means a wrong direction
UNHELD = wp.constant(1.0e-2)  # a smaller overlap needs no contact
SHALLOW = wp.constant(2.0e-2)  # of depths: a normal turns little over a shorter way
NEAR_WALL = wp.constant(5.0e-2)  # a vertex this close to a wall may lie flush in it

# Motion. Those of the broad phase and of steps are of the shortest edge.
STILL = wp.constant(2.0e-3)  # how far a body may move and still be at rest
FAST = wp.constant(2.0e-2)  # in a frame: a faster body is not at rest
ISLAND_GAP = wp.constant(2.0e-2)  # boxes this close belong to one island
SEARCH_BOUND = wp.constant(2.0e-2)  # the largest move in a step: more would invert a deep body
LEAST_SKIN = wp.constant(2.0e-2)  # for what friction and closure move at rest
MEAN_SKIN = wp.constant(8.0e-2)  # a wider skin costs more by its longer lists
PERSISTENT = wp.constant(0.5 * 2.0e-2)  # half of LEAST_SKIN: contacts within are among the pairs
LINGERING = wp.constant(2.5e-2)  # as TRAVEL, while overlaps may last some steps
TRAVEL = wp.constant(1.0e-1)  # largest relative motion in a step: an impact crushes no tet at once
