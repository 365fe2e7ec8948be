"""Checks of arguments: what cannot work fails where it is given, with name, value and remedy.

Each function returns the value in the type that the code works with, or raises ValueError.
"""

import math
import os
from numbers import Integral
from pathlib import Path
from types import UnionType

import numpy as np

LARGEST = 1e18  # of any number: its square still fits float32
SMALLEST = 1e-18  # of a number that must be above zero: the same for its inverse
MOST = 2**31 - 1  # of a count: it lies in int32 arrays
FASTEST = 3e8  # of a velocity [m/s]: light
LONGEST = 100  # characters of a name


def refuse(name: str, value, wanted: str) -> ValueError:
    """The error for an argument; ``wanted`` says what to give instead."""
    return ValueError(f"{name} {shown(value)}: give {wanted}")


def shown(value) -> str:
    """A value in one short line."""
    if isinstance(value, np.ndarray) and value.size > 6:
        return f"of shape {value.shape} and type {value.dtype}"
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."


def number(value, name: str, least: float = -LARGEST, most: float = LARGEST) -> float:
    """A finite number from ``least`` to ``most``."""
    array = array_of(value)
    result = float(array) if array.shape == () and _is_real(array) else math.nan
    if not least <= result <= most:
        if most < LARGEST:
            wanted = f"a number from {least:g} to {most:g}"
        elif least > -LARGEST:
            wanted = f"a number of {least:g} or more"
        else:
            wanted = f"a finite number, at most {most:g} in size"
        raise refuse(name, value, wanted)
    return result


def positive(value, name: str, most: float = LARGEST) -> float:
    """A number above zero."""
    try:
        return number(value, name, SMALLEST, most)
    except ValueError:
        raise refuse(name, value, f"a number above 0, from {SMALLEST:g} to {most:g}") from None


def numbers(value, shape: tuple, name: str, most: float = LARGEST) -> np.ndarray:
    """Finite numbers of a shape, as float64; the array is a new one."""
    array = array_of(value)
    wanted = f"finite numbers of shape {shape}, at most {most:g} in size"
    if not _is_real(array) or array.shape != shape:
        raise refuse(name, value, wanted)
    result = array.astype(np.float64)
    bad = np.argwhere(~(np.abs(result) <= most))
    if len(bad):
        at = tuple(bad[0].tolist())
        raise refuse(name, value, f"{wanted}; at {at} it is {result[at]}")
    return result


def vectors(value, n: int, name: str, most: float = LARGEST) -> np.ndarray:
    """Three finite numbers, or three for each of ``n``, shape (3,) or (n, 3)."""
    return numbers(value, (n, 3) if array_of(value).ndim == 2 else (3,), name, most)


def colors(value, n: int) -> np.ndarray:
    """Linear red, green, blue from 0 to 1, shape (3,), or (n, 3) for each of ``n``."""
    result = vectors(value, n, "colors")
    if not 0.0 <= result.min() <= result.max() <= 1.0:
        raise refuse("colors", value, "linear red, green and blue from 0 to 1")
    return result


def sight(eye, target, of: str = "") -> tuple[np.ndarray, np.ndarray]:
    """Where a camera stands and what it looks at, in different places, shape (3,) each."""
    eye, target = numbers(eye, (3,), f"{of}eye"), numbers(target, (3,), f"{of}target")
    if np.linalg.norm(eye - target) < SMALLEST:
        raise refuse(f"{of}eye", eye.tolist(), "another place than that of the target")
    return eye, target


def count(value, name: str, least: int = 1, most: int = MOST) -> int:
    """A whole number from ``least`` to ``most``."""
    whole = isinstance(value, Integral) and not isinstance(value, bool | np.bool_)
    if not whole or not least <= value <= most:
        raise refuse(name, value, f"a whole number from {least} to {most}")
    return int(value)


def flag(value, name: str) -> bool:
    """True or False."""
    if not isinstance(value, bool | np.bool_):
        raise refuse(name, value, "True or False")
    return bool(value)


def one_of(value, choices: tuple, name: str):
    """One of several values."""
    if not any(type(value) is type(choice) and value == choice for choice in choices):
        raise refuse(name, value, " or ".join(map(repr, choices)))
    return value


def label(value, name: str) -> str:
    """A text that can stand in one line of a report."""
    if not isinstance(value, str) or not value.isprintable() or not 0 < len(value) <= LONGEST:
        raise refuse(name, value, f"a text of 1 to {LONGEST} printable characters")
    return str(value)


def path(value, name: str) -> Path:
    """The path of a file or folder."""
    if not isinstance(value, str | os.PathLike) or not os.fspath(value):
        raise refuse(name, value, "a path")
    if "\0" in str(value):
        raise refuse(name, value, "a path without a zero byte")
    return Path(value)


def instance(value, kind: type | UnionType, name: str, remedy: str):
    """A value of a class; what is often given instead is the class itself."""
    if not isinstance(value, kind):
        raise refuse(name, value, remedy)
    return value


def vertex_ids(chosen, n: int, name: str) -> np.ndarray:
    """Ids that a mask of ``n`` vertices, or a list of different ids, chooses."""
    wanted = f"a mask of shape ({n},) or a list of different ids from 0 to {n - 1}"
    array = array_of(chosen)
    if array.dtype == bool and array.shape == (n,):
        return np.flatnonzero(array)
    if array.ndim != 1 or (array.size and array.dtype.kind not in "iu"):
        raise refuse(name, chosen, wanted)
    wrong = array[(array < 0) | (array >= n)]
    if wrong.size:
        raise refuse(name, chosen, f"{wanted}; it names vertex {wrong[0]}")
    ids = array.astype(np.int64)
    if len(np.unique(ids)) < len(ids):
        raise refuse(name, chosen, f"{wanted}; it names one twice")
    return ids


def array_of(value) -> np.ndarray:
    """The value as an array, one without numbers where it is ragged."""
    try:
        return np.asarray(value)
    except ValueError:
        return np.asarray(None)


def _is_real(array: np.ndarray) -> bool:
    return array.dtype.kind in "iuf"
