"""Every length that is a part of a mean edge: one table, with the reason of each.

A tolerance of contact has to be judged against the mesh: what is negligible on a coarse body is not
on a fine one. All of these are parts [-] of the mean edge of a body, or of the shortest one of the
scene where it says so.
"""

import warp as wp

# Gaps and overlaps, from the smallest.
FLUSH = wp.constant(1.0e-5)  # a vertex this deep lies in the surface
BOX_GROWTH = wp.constant(1.0e-5)  # a flat triangle's box must not vanish for a ray
IMPULSE_TOLERANCE = wp.constant(1.0e-5)  # an approach in one step that is left to the closure
CLOSURE_TOLERANCE = wp.constant(1.0e-4)  # less overlap is left to the resting gap
REST_GAP = wp.constant(
    2.0e-4
)  # left between bodies at rest: rounding does not decide who is inside
FLUSH_EDGE = wp.constant(2.0e-4)  # an edge this deep lies in the face, whatever its direction
VERTEX_MARGIN = wp.constant(1.0e-3)  # speculative: a vertex this close makes a contact with a gap
OLD_OVERLAP = wp.constant(1.0e-3)  # at the start of a step: no step made it, it is to be searched
SAME_PLACE = wp.constant(1.0e-3)  # surfaces nearer than this do not show an overlap to search
STALE_OVERLAP = wp.constant(2.0e-3)  # at the start of a step: it tells a wrong direction
UNHELD = wp.constant(1.0e-2)  # an overlap that is less deep needs no contact
NEAR_WALL = wp.constant(5.0e-2)  # a vertex this close to a wall may lie in it

# Motion. Those of the broad phase and of steps are of the shortest edge.
STILL = wp.constant(2.0e-3)  # how far a body may move and still be at rest
FAST = wp.constant(2.0e-2)  # in a frame: the speed of what is on its way
ISLAND_GAP = wp.constant(2.0e-2)  # boxes this close belong to one island of sleepers
SEARCH_BOUND = wp.constant(2.0e-2)  # in a step of the search: more would invert a deep start
LEAST_SKIN = wp.constant(2.0e-2)  # with friction and closure at rest in mind
MEAN_SKIN = wp.constant(8.0e-2)  # longer lists cost more than they save
PERSISTENT = wp.constant(0.5 * 2.0e-2)  # half of LEAST_SKIN: within it, all is among the pairs
LINGERING = wp.constant(2.5e-2)  # as TRAVEL, where overlaps may last some steps
TRAVEL = wp.constant(1.0e-1)  # in a step, against anything else: an impact crushes no tet at once
