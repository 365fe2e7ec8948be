"""A plane that cuts off what lies beyond it: rays go through that, and bodies show their inside.

    n . x > d    is cut off

What a ray meets first after it came through the plane tells where it came in: a triangle seen from
behind is of the body that the point of the plane is in, as surfaces are closed.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

FAR = wp.constant(1.0e30)


@wp.func
def kept(cut: wp.vec4, o: wp.vec3, d: wp.vec3) -> wp.vec2:
    """Where a ray enters what is kept and leaves it, as distances along it [m]."""
    n = wp.vec3(cut[0], cut[1], cut[2])
    gap = cut[3] - wp.dot(n, o)  # above zero where the ray begins in what is kept
    slope = wp.dot(n, d)
    if gap >= 0.0:
        return wp.vec2(0.0, wp.where(slope > 0.0, gap / wp.max(slope, 1.0e-20), FAR))
    return wp.vec2(wp.where(slope < 0.0, gap / wp.min(slope, -1.0e-20), FAR), FAR)


@wp.func
def meets(mesh: wp.uint64, cut: wp.vec4, o: wp.vec3, d: wp.vec3, most: float) -> bool:
    """Whether a ray meets a triangle that is not cut off within a distance [m]."""
    way = kept(cut, o, d)
    end = wp.min(way[1], most)
    if way[0] >= end:
        return False
    return wp.mesh_query_ray_anyhit(mesh, o + way[0] * d, d, end - way[0])
