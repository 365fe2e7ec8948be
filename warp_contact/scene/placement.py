"""Checks of the shape and the placement of bodies: where no simulation can start."""

import warnings

import numpy as np

from warp_contact import checks
from warp_contact.kernels.lengths import REST_GAP, SAME_PLACE
from warp_contact.scene.mesh import TetMesh
from warp_contact.scene.surface import Surface

ROUNDING = 2.0**-24  # of a float32, at most
# Resting gaps by which rounding may move a body. At 1.5, 5000 edges away, blocks that fall and come
# to rest end within 1 % of a size of where they do at the origin, at 3 within 4 %.
DROWNED = 1.5
STRAINED = 0.02  # strain that rounding of the positions may put on a tet
POSSIBLE = 1e-8, 1e9  # size of a body [m] whose masses and volumes fit float32
PLAUSIBLE = 0.9e-6, 1.1e3  # size of a body [m]; others run too
CRUSHED = 100.0  # pressure of its own weight, in Young's moduli, under which nothing keeps a shape


def check_given(mesh, material, label: str, render) -> None:
    """Raises ValueError for what is no mesh, material or render surface, or a class not called."""
    if not isinstance(mesh, TetMesh):
        such = "wc.shell(surface, 0.01)" if isinstance(mesh, Surface) else "wc.box(0.1, 2)"
        raise checks.refuse("mesh", mesh, f"a TetMesh, such as {such}")
    if isinstance(material, type) or not callable(getattr(material, "check", None)):
        wanted = "a material, such as wc.NeoHookean(1e5, 0.4, 1000.0)"
        raise checks.refuse("material", material, wanted)
    material.check()
    check_shape(mesh, label)
    if render is not None:
        _check_render(render, mesh)


def _check_render(render, mesh: TetMesh) -> None:
    """Raises ValueError for what is no surface, or lies elsewhere than its mesh."""
    checks.instance(render, Surface, "render", "a wc.Surface")
    x, size = mesh.vertices, float(np.ptp(mesh.vertices, axis=0).max())
    off = np.maximum(render.vertices - x.max(axis=0), x.min(axis=0) - render.vertices).max()
    if off > size:
        raise ValueError(
            f"its render surface reaches {off:.3g} m away from its mesh of {size:.3g} m: give it "
            f"in the frame and the unit of the mesh"
        )


def check_shape(mesh, label: str) -> None:
    """Warn of a mesh [m] of an unlikely size, or one that falls apart along seams.

    Raises:
        ValueError: every tet has vertices of its own, or its size has no place in float32
    """
    size = float(np.ptp(mesh.vertices, axis=0).max())
    if not POSSIBLE[0] <= size <= POSSIBLE[1]:
        raise ValueError(
            f"its mesh is {size:.4g} m large, and must have {POSSIBLE[0]:g} to {POSSIBLE[1]:g} m: "
            f"take mesh.scaled(...)"
        )
    if not PLAUSIBLE[0] <= size <= PLAUSIBLE[1]:
        warnings.warn(
            f"body '{label}' is {size:.4g} m large; for millimetres load its mesh with unit=1e-3, "
            f"or take mesh.scaled(1e-3, 1e-3, 1e-3)",
            stacklevel=3,
        )
    if not len(mesh.seams):
        return
    if mesh.n_pieces == len(mesh.tets) > 1:
        raise ValueError("its tets share no vertex, so that they fall apart: take mesh.welded()")
    warnings.warn(
        f"body '{label}': {len(mesh.seams)} pairs of its surface vertices are in the same place "
        f"but not joined: its {mesh.n_pieces} pieces part there; mesh.welded() joins them",
        stacklevel=3,
    )


def check(bodies: list) -> None:
    """Check every body of a scene by itself, and every two.

    Raises:
        ValueError: naming a body that is so far from the origin that rounding moves it by
            ``DROWNED`` resting gaps, or a tet so flat that rounding strains it by more than
            ``STRAINED``, or two of one world, not both fixed, that fill the same space:
            neither is inside the other, and no direction leads out
    """
    edges = [_mean_edge(body) for body in bodies]
    for body, edge in zip(bodies, edges, strict=True):
        check_distance(body.starts, edge, body.label)
        if not np.isfinite(body.v).all():
            raise ValueError(f"body '{body.label}' has a velocity that is not finite")
        strain = float(np.abs(body.starts).max()) * ROUNDING / _heights(body)
        if strain.max() > STRAINED:
            raise ValueError(
                f"body '{body.label}', tet {int(strain.argmax())} is too flat: rounding of its "
                f"positions would strain it by {strain.max():.2g}; remesh it"
            )
    check_apart(bodies, edges)


def check_weights(bodies: list, gravity: np.ndarray) -> None:
    """Warn of bodies that their own weight crushes: most often a unit is wrong."""
    for body in bodies:
        young = getattr(body.material, "youngs_modulus", None)
        if young is None or np.all(body.fixed):
            continue
        pressure = body.material.density * float(np.ptp(body.starts @ gravity))
        if pressure > CRUSHED * young:
            warnings.warn(
                f"body '{body.label}': at its foot its own weight presses with {pressure:.3g} Pa, "
                f"{pressure / young:.3g} times its Young's modulus, and crushes it; check "
                f"youngs_modulus [Pa], density [kg/m^3], its size [m] and gravity [m/s^2]",
                stacklevel=5,
            )


def check_distance(x: np.ndarray, edge: float, label: str) -> None:
    """Check the positions [m] of a body of a mean edge [m]; raises ValueError."""
    far, most = float(np.abs(x).max()), DROWNED * REST_GAP * edge / ROUNDING
    if not far <= most:  # nor for what is no number
        raise ValueError(
            f"body '{label}' is {far:.4g} m from the origin: beyond {most:.4g} m, "
            f"rounding is {DROWNED:g} times its gap at rest; place the scene about the origin"
        )


def check_apart(bodies: list, edges: list) -> None:
    """Check that no two bodies, of given mean edges [m], fill the same space; as ``check``."""
    shape = np.array([_shape(body) for body in bodies])
    slack = SAME_PLACE * np.array(edges)
    world = np.array([body.world for body in bodies])
    held = np.array([bool(np.all(body.fixed)) for body in bodies])
    mix = np.sqrt(np.arange(2.0, 2.0 + shape.shape[1]))
    along, reach = shape @ mix, slack.max() * mix.sum()  # equal shapes are near each other along it
    order = np.lexsort((along, world))
    for k in range(1, len(bodies)):
        p, q = order[:-k], order[k:]
        near = (world[p] == world[q]) & (along[q] - along[p] <= reach)
        if not near.any():
            return
        same = near & (np.abs(shape[p] - shape[q]).max(axis=1) <= np.minimum(slack[p], slack[q]))
        same &= ~(held[p] & held[q])
        if same.any():
            a, b = sorted((int(p[same.argmax()]), int(q[same.argmax()])))
            raise ValueError(
                f"body '{bodies[a].label}' and body '{bodies[b].label}' are in the same place, to "
                f"{SAME_PLACE:g} of an edge: no direction leads out; move one of them"
            )


def _shape(body) -> np.ndarray:
    """Lengths [m] that tell a placed body from others: its box, middle and six radii, shape (15,).

    The radii are the root mean squares of the distances of its points from six planes through its
    middle, those of the axes and of the diagonals.
    """
    x = body.starts
    corner = x[body.mesh.tets]
    weight = body.mesh.volumes / body.mesh.volume
    middle = weight @ corner.mean(axis=1)
    r = corner - middle
    total = r.sum(axis=1)
    square = np.einsum("m,mki,mkj->ij", weight, r, r)
    square += np.einsum("m,mi,mj->ij", weight, total, total)
    n = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1]], dtype=float)
    radius = np.sqrt(np.einsum("ai,ij,aj->a", n, square / 20.0, n))
    return np.concatenate([x.min(axis=0), x.max(axis=0), middle, radius])


def _heights(body) -> np.ndarray:
    """Least height of each tet [m], shape (n_tet,)."""
    a, b, c, d = np.moveaxis(body.mesh.vertices[body.mesh.tets], 1, 0)
    faces = ((b, c, d), (a, c, d), (a, b, d), (a, b, c))
    doubled = [np.linalg.norm(np.cross(q - p, r - p), axis=1) for p, q, r in faces]
    return 6.0 * body.mesh.volumes / np.max(doubled, axis=0)


def _mean_edge(body) -> float:
    p, q = body.mesh.edges.T
    return float(np.linalg.norm(body.mesh.vertices[p] - body.mesh.vertices[q], axis=1).mean())
