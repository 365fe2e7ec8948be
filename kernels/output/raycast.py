"""Pictures by ray casting: sun, sky, soft shadows and a ground that fades into the background.

    L = c (E_sun V max(n . l, 0) + E_sky(n) A) + s V      radiance of a body, colour c
    V: share of the sun's disc that is visible            rays over the disc
    A: share of the sky that is visible                   cosine-weighted rays; occluders glow
    s: highlight of a rough coat (Blinn 1977)

Secondary rays start on a curved surface through the vertex normals, not on the facet (Hanika 2021,
Hacking the shadow terminator). Otherwise shadows would show the facets of a coarse mesh.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.output.cut import FAR, kept, meets

wp.set_module_options(OPTIONS)

GLOW = wp.constant(0.3)  # light from what occludes the sky, as a share of that from below [-]
GOLDEN = wp.constant(0.6180339887498949)


@wp.struct
class View:
    eye: wp.vec3  # [m]
    right: wp.vec3  # to the right border of the picture at unit distance [-]
    up: wp.vec3  # to its upper border at unit distance [-]
    forward: wp.vec3  # unit [-]
    width: int  # [pixels]
    height: int  # [pixels]
    samples: int  # along each side of a pixel
    rays: int  # to the sun, and to the sky, a sample
    wire: float  # darkening of the edges of triangles [-]


@wp.struct
class Light:
    mesh: wp.uint64  # the triangles that occlude it
    cut: wp.vec4  # [-] and [m], normal and offset of a plane: beyond it nothing is there
    sun: wp.vec3  # unit, toward the sun [-]
    sun_power: float  # [-]
    sun_size: float  # tangent of the half angle of its disc [-]
    sky: wp.vec3  # irradiance from above [-]
    bounce: wp.vec3  # irradiance from below [-]
    high: wp.vec3  # background above, linear [-]
    low: wp.vec3  # background below, linear [-]
    ground: wp.vec3  # colour of the ground, linear [-]
    center: wp.vec3  # where the ground starts to fade [m]
    reach: float  # size of the scene [m]


@wp.struct
class Draw:
    first: int  # number of the first ray of this sample
    count: int  # rays of this sample
    total: int  # rays of the pixel
    shift: wp.vec2  # random shift of the pixel's directions [-]


@wp.func
def fraction(x: float) -> float:
    return x - wp.floor(x)


@wp.func
def dither(i: int, j: int) -> float:
    """Interleaved gradient noise (Jimenez 2014): even over any few neighbouring pixels."""
    return fraction(52.9829189 * fraction(0.06711056 * float(i) + 0.00583715 * float(j)))


@wp.func
def background(d: wp.vec3, light: Light) -> wp.vec3:
    s = wp.clamp(0.5 + 1.2 * d[2], 0.0, 1.0)
    return (1.0 - s) * light.low + s * light.high


@wp.func
def tangent(n: wp.vec3) -> wp.vec3:
    if wp.abs(n[0]) > 0.7:
        return wp.normalize(wp.cross(n, wp.vec3(0.0, 1.0, 0.0)))
    return wp.normalize(wp.cross(n, wp.vec3(1.0, 0.0, 0.0)))


@wp.func
def sun_light(p: wp.vec3, n: wp.vec3, light: Light, draw: Draw) -> float:
    if wp.dot(n, light.sun) <= 0.0:
        return 0.0
    a = tangent(light.sun)
    b = wp.cross(light.sun, a)
    seen = float(0.0)
    for k in range(draw.count):
        u = fraction((float(draw.first + k) + 0.5) / float(draw.total) + draw.shift[1])
        v = wp.TAU * fraction(float(draw.first + k) * GOLDEN + draw.shift[0])
        d = light.sun + light.sun_size * wp.sqrt(u) * (wp.cos(v) * a + wp.sin(v) * b)
        if not meets(light.mesh, light.cut, p, wp.normalize(d), FAR):
            seen += 1.0 / float(draw.count)
    return seen


@wp.func
def sky_light(p: wp.vec3, n: wp.vec3, light: Light, draw: Draw) -> wp.vec3:
    a = tangent(n)
    b = wp.cross(n, a)
    e = wp.vec3(0.0)
    for k in range(draw.count):
        u = fraction((float(draw.first + k) + 0.5) / float(draw.total) + draw.shift[0])
        v = wp.TAU * fraction(float(draw.first + k) * GOLDEN + draw.shift[1])
        d = wp.sqrt(u) * (wp.cos(v) * a + wp.sin(v) * b) + wp.sqrt(1.0 - u) * n
        s = 0.5 + 0.5 * d[2]
        if meets(light.mesh, light.cut, p, d, light.reach):
            e += GLOW * light.bounce / float(draw.count)
        else:
            e += (s * light.sky + (1.0 - s) * light.bounce) / float(draw.count)
    return e


@wp.func
def nearest_plane(plane: wp.array[wp.vec4], o: wp.vec3, d: wp.vec3, t_max: float) -> wp.vec2:
    """Distance along the ray and index of the plane, -1 if none is met from outside."""
    best = wp.vec2(t_max, -1.0)
    for k in range(plane.shape[0]):
        n = wp.vec3(plane[k][0], plane[k][1], plane[k][2])
        gap = wp.dot(n, o) - plane[k][3]
        slope = wp.dot(n, d)
        if gap > 0.0 and slope < 0.0 and -gap / slope < best[0]:
            best = wp.vec2(-gap / slope, float(k))
    return best


@wp.func
def on_curve(p: wp.vec3, x: wp.vec3, n: wp.vec3) -> wp.vec3:
    return p - wp.min(wp.dot(p - x, n), 0.0) * n


@wp.func
def edge_distance(p: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3) -> float:
    """Distance [m] of a point in the triangle from its border."""
    area = wp.length(wp.cross(b - a, c - a))
    d = wp.length(wp.cross(b - p, c - p)) / wp.max(wp.length(b - c), 1.0e-12)
    d = wp.min(d, wp.length(wp.cross(c - p, a - p)) / wp.max(wp.length(c - a), 1.0e-12))
    d = wp.min(d, wp.length(wp.cross(a - p, b - p)) / wp.max(wp.length(a - b), 1.0e-12))
    return wp.where(area > 0.0, d, 0.0)


@wp.func
def ground_color(p: wp.vec3, d: wp.vec3, n: wp.vec3, light: Light, draw: Draw) -> wp.vec3:
    o = p + 1.0e-4 * light.reach * n
    e = light.sun_power * sun_light(o, n, light, draw) * wp.dot(n, light.sun)
    c = wp.cw_mul(light.ground, wp.vec3(e) + sky_light(o, n, light, draw))
    s = wp.clamp((wp.length(p - light.center) / light.reach - 0.8) / 3.0, 0.0, 1.0)
    s = s * s * (3.0 - 2.0 * s)
    return (1.0 - s) * c + s * background(d, light)


@wp.func
def body_color(
    hit: wp.MeshQueryRay,
    d: wp.vec3,
    color: wp.array[wp.vec3],
    normal: wp.array[wp.vec3],
    light: Light,
    view: View,
    draw: Draw,
) -> wp.vec3:
    t = hit.face
    w = 1.0 - hit.u - hit.v
    xa = wp.mesh_get_point(light.mesh, 3 * t)
    xb = wp.mesh_get_point(light.mesh, 3 * t + 1)
    xc = wp.mesh_get_point(light.mesh, 3 * t + 2)
    p = hit.u * xa + hit.v * xb + w * xc
    flip = wp.where(wp.dot(hit.normal, d) > 0.0, -1.0, 1.0)  # seen from inside: light that side
    na = flip * normal[3 * t]
    nb = flip * normal[3 * t + 1]
    nc = flip * normal[3 * t + 2]
    n = wp.normalize(hit.u * na + hit.v * nb + w * nc)
    o = hit.u * on_curve(p, xa, na) + hit.v * on_curve(p, xb, nb) + w * on_curve(p, xc, nc)
    o += 1.0e-4 * light.reach * flip * hit.normal

    c = hit.u * color[wp.mesh_get_index(light.mesh, 3 * t)]
    c += hit.v * color[wp.mesh_get_index(light.mesh, 3 * t + 1)]
    c += w * color[wp.mesh_get_index(light.mesh, 3 * t + 2)]
    pixel = 2.0 * wp.length(p - view.eye) * wp.length(view.up) / float(view.height)
    c *= 1.0 - view.wire * wp.clamp(1.5 - edge_distance(p, xa, xb, xc) / pixel, 0.0, 1.0)

    sun = light.sun_power * sun_light(o, n, light, draw)
    shine = wp.max(wp.dot(n, wp.normalize(light.sun - d)), 0.0)
    e = wp.vec3(sun * wp.max(wp.dot(n, light.sun), 0.0)) + sky_light(o, n, light, draw)
    return wp.cw_mul(c, e) + wp.vec3(0.08 * sun * wp.pow(shine, 30.0))


@wp.func
def cut_color(c: wp.vec3, light: Light) -> wp.vec3:
    """The inside of a body, of colour c, where the plane cuts it: nothing stands before it."""
    n = wp.vec3(light.cut[0], light.cut[1], light.cut[2])
    s = 0.5 + n[2] / 3.0  # mean of that of ``sky_light``
    sun = light.sun_power * wp.max(wp.dot(n, light.sun), 0.0)
    return wp.cw_mul(c, wp.vec3(sun) + s * light.sky + (1.0 - s) * light.bounce)


@wp.func
def screen(c: float) -> float:
    """The sRGB code of a linear value."""
    s = wp.clamp(c, 0.0, 1.0)
    if s <= 0.0031308:
        return 12.92 * s
    return 1.055 * wp.pow(s, 1.0 / 2.4) - 0.055


@wp.kernel
def set_face_normals(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    tri: wp.array[wp.vec3i],  # (n_tri,)
    # out
    area: wp.array[wp.vec3],  # (n_tri,) [m^2], normal times twice the area
):
    """One thread per triangle: set its area vector."""
    t = wp.tid()
    a = x[tri[t][0]]
    area[t] = wp.cross(x[tri[t][1]] - a, x[tri[t][2]] - a)


@wp.kernel
def set_corner_normals(
    # in
    tri: wp.array[wp.vec3i],  # (n_tri,)
    start: wp.array[int],  # (n_vert + 1,)
    around: wp.array[int],  # (3 n_tri,), triangles at each vertex
    rest: wp.array[wp.vec3],  # (n_tri,) [m^2], area vectors that decide which edges are sharp
    area: wp.array[wp.vec3],  # (n_tri,) [m^2]
    crease: float,  # cosine of the sharpest smooth angle [-]
    # out
    normal: wp.array[wp.vec3],  # (3 n_tri,) [-]
):
    """One thread per corner: average the normals that meet there without a crease."""
    c = wp.tid()
    t = c // 3
    i = tri[t][c - 3 * t]
    n = wp.vec3(0.0)
    for k in range(start[i], start[i + 1]):
        other = around[k]
        same = crease * wp.length(rest[t]) * wp.length(rest[other])
        if other == t or wp.dot(rest[t], rest[other]) >= same:
            n += area[other]
    normal[c] = wp.normalize(n)


@wp.kernel
def cast(
    # in
    view: View,
    light: Light,
    plane: wp.array[wp.vec4],  # (n_plane,) [-] and [m], normal and offset
    color: wp.array[wp.vec3],  # (n_vert,) [-], linear
    normal: wp.array[wp.vec3],  # (3 n_tri,) [-], of each corner
    inside: wp.array[wp.vec3],  # (n_vert,) [-], linear, of what is within the body of a vertex
    # out
    picture: wp.array[wp.vec3],  # (height width,) [-], sRGB
):
    """One thread per pixel: average its samples."""
    i = wp.tid()
    draw = Draw()
    draw.count = view.rays
    draw.total = view.samples * view.samples * view.rays
    draw.shift = wp.vec2(
        dither(i % view.width, i // view.width), dither(i // view.width, i % view.width + 47)
    )
    sum = wp.vec3(0.0)
    for s in range(view.samples * view.samples):
        across = (float(s % view.samples) + 0.5) / float(view.samples) + float(i % view.width)
        down = (float(s // view.samples) + 0.5) / float(view.samples) + float(i // view.width)
        u = 2.0 * across / float(view.width) - 1.0
        v = 1.0 - 2.0 * down / float(view.height)
        d = wp.normalize(view.forward + u * view.right + v * view.up)
        draw.first = s * view.rays
        way = kept(light.cut, view.eye, d)
        start = view.eye + wp.where(way[0] < FAR, way[0], 0.0) * d
        hit = wp.mesh_query_ray(light.mesh, start, d, way[1] - way[0])
        is_cut = hit.result and way[0] > 0.0 and wp.dot(hit.normal, d) > 0.0
        limit = wp.where(hit.result, way[0] + wp.where(is_cut, 0.0, hit.t), FAR)
        ground = nearest_plane(plane, view.eye, d, limit)
        if ground[1] >= 0.0:
            k = int(ground[1])
            n = wp.vec3(plane[k][0], plane[k][1], plane[k][2])
            p = view.eye + ground[0] * d
            sum += ground_color(p, d, n, light, draw)
        elif is_cut:
            sum += cut_color(inside[wp.mesh_get_index(light.mesh, 3 * hit.face)], light)
        elif hit.result:
            sum += body_color(hit, d, color, normal, light, view, draw)
        else:
            sum += background(d, light)
    c = sum / float(view.samples * view.samples)
    picture[i] = wp.vec3(screen(c[0]), screen(c[1]), screen(c[2]))
