"""Pressures and forces of a frame, from the primvars of a stage, as shapes that can be drawn."""

import numpy as np
from pxr import UsdGeom

from warp_contact.usd.prims import heated, shades

LEVELS = 8  # colours of pressures
YELLOW = 0.9, 0.65, 0.25  # linear colour of the lowest level
LIFT = 0.02  # by which what is coloured lies above its surface, of its size
WEAK = 1e-3  # forces below this part of the largest have no arrow


def primvar(mesh: UsdGeom.Mesh, name: str, n: int, frame: float, absent: float) -> np.ndarray:
    """``contact:<name>`` of the ``n`` points of a mesh, shape (n,); ``absent`` if it has none."""
    found = UsdGeom.PrimvarsAPI(mesh).GetPrimvar(f"contact:{name}")
    value = np.asarray(found.Get(frame) or () if found else (), dtype=float)
    return value if len(value) == n else np.full(n, absent)


def hot(x: np.ndarray, tris: np.ndarray, pressure: np.ndarray, most: float) -> list[np.ndarray]:
    """Corners of the triangles of each level of pressure, lifted off their surface.

    What is below 1 / (LEVELS + 1)^2 of the highest is of no level.

    Args:
        x: positions [m], shape (n_vert, 3)
        tris: shape (n_tri, 3)
        pressure: [Pa], shape (n_vert,)
        most: pressure [Pa] of the highest level
    """
    mean = pressure[tris].mean(axis=1)
    level = ((LEVELS + 1) * np.sqrt(np.clip(mean / most, 0.0, 1.0))).astype(int).clip(0, LEVELS)
    chosen = np.flatnonzero(level)
    corners = x[tris[chosen]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.sqrt(np.linalg.norm(normal, axis=1, keepdims=True))
    corners = corners + (LIFT * normal / np.maximum(size, 1e-30))[:, None]
    return [corners[level[chosen] == k].reshape(-1, 3) for k in range(1, LEVELS + 1)]


def level_colors() -> np.ndarray:
    """Linear colour of each level, shape (LEVELS, 3)."""
    return heated(np.float32(YELLOW))[shades(np.linspace(0.0, 1.0, LEVELS) ** 2)]


def contact_forces(
    x: np.ndarray, tris: np.ndarray, pressure: np.ndarray, partner: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Centre of pressure [m] and force [N] on a body from each of its partners.

    It has the size of all pressures times areas, friction included, and the direction of the
    surface where they act: friction does not turn it.
    """
    a, b, c = (x[tris[:, k]] for k in range(3))
    area = np.cross(b - a, c - a) / 6.0
    normal, share = np.zeros((len(x), 3)), np.zeros(len(x))
    np.add.at(normal, tris.ravel(), np.repeat(area, 3, axis=0))
    np.add.at(share, tris.ravel(), np.repeat(np.linalg.norm(area, axis=1), 3))
    found = []
    for other in np.unique(partner[(partner >= 0) & (pressure > 0.0)]):
        force = np.where(partner == other, pressure * share, 0.0)
        along = -(force @ normal)
        length = np.linalg.norm(along)
        if force.sum() > 0.0 and length > 0.0:
            found.append((force @ x / force.sum(), force.sum() * along / length))
    return found


def arrows(found: list[tuple[np.ndarray, np.ndarray]], most: float, longest: float) -> np.ndarray:
    """From where to where each force is drawn [m], shape (n, 2, 3); ``most`` [N] is ``longest``."""
    strong = [(p, f) for p, f in found if np.linalg.norm(f) > WEAK * most]
    ends = [(p, p + f * longest / most) for p, f in strong]
    return np.array(ends, dtype=np.float32).reshape(-1, 2, 3)
