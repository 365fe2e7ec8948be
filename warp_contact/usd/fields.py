"""What contact does to the vertices of a body, as primvars of its surface."""

import numpy as np
from pxr import Sdf, Vt

from warp_contact.usd.prims import Part

# Distinct values of a scalar in a frame. The crate format packs floats where there are at most 1024
# of them and four times as many numbers. To n / 8 of them it takes 2 bytes a number instead of 4.
LEVELS = 1000
PACKED = 1000  # points of a body from which on it is worth it


def field_types(part: Part) -> dict[str, Sdf.ValueTypeName]:
    """The attributes, by their paths."""
    types, primvars = Sdf.ValueTypeNames, f"{part.surface}.primvars:"
    return {
        f"{primvars}displayColor:indices": types.IntArray,
        f"{primvars}contact:pressure": types.FloatArray,
        f"{primvars}contact:penetration": types.FloatArray,
        f"{primvars}contact:partner": types.IntArray,
    }


def field_values(part: Part, shade: np.ndarray, fields: dict[str, np.ndarray]) -> tuple:
    """Their values, of the ``shades`` and the contact fields of all vertices."""
    scalars = (rounded(fields[name][part.ids]) for name in ("pressure", "penetration"))
    shade, partner = (
        np.ascontiguousarray(a[part.ids], np.int32) for a in (shade, fields["partner"])
    )
    integers = Vt.IntArray.FromNumpy(shade), Vt.IntArray.FromNumpy(partner)
    return integers[0], *map(Vt.FloatArray.FromNumpy, scalars), integers[1]


def rounded(value: np.ndarray) -> np.ndarray:
    """The values on a scale of at most ``LEVELS`` steps between 0 and their largest, or fewer."""
    value = np.ascontiguousarray(value, dtype=np.float32)
    levels = min(max(len(value) // 8, 250), LEVELS) if len(value) >= PACKED else LEVELS
    step = np.float32(np.abs(value).max(initial=0.0) / (levels - 1))
    return np.rint(value / step) * step if step > 0.0 else value


def hydrostatic(sim) -> float:
    """Twice the pressure [Pa] at the bottom of a column as high as the scene; 0 without gravity."""
    densities = [getattr(material, "density", 0.0) or 0.0 for material in sim.model.materials]
    x = sim.positions()
    size = float(np.linalg.norm(np.ptp(x, axis=0)))
    return 2.0 * max(densities, default=0.0) * float(np.linalg.norm(sim.model.gravity)) * size
