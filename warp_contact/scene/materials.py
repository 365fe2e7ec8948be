"""Constitutive models: what the user names, and the parameters the kernels read.

A model is one kernel file (``kernels/elastic/<model>.py``) and one class here with

* ``kernels``: that file, or None for a body that does not deform. It provides the kernels
  ``set_forces``, ``apply_stiffness``, ``apply_damping`` and ``energies``. Their signatures are the
  same for all models except for ``param``, an array of ``ROW``: a Warp vector, or ``float`` where
  ``param`` has two dimensions;
* ``density`` [kg/m^3] and ``damping`` [s];
* ``parameters(vertices, tets)``: one row per tet, in the order in which the kernels read it;
* ``check()``: raises ValueError with a reason.
"""

from dataclasses import KW_ONLY, dataclass, fields
from types import ModuleType
from typing import ClassVar

import numpy as np

from warp_contact import checks
from warp_contact.data.model import Solid
from warp_contact.kernels.elastic import corotated, neo_hookean, springs
from warp_contact.scene.topology import EDGES, HUGE, signed_volumes

OPPOSITE = ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))  # opposite to corners 0, 1, 2, 3
DENSITY = 1e-6, 1e9  # [kg/m^3]; masses and their inverses fit float32 in bodies of any size
STIFFNESS = 1e-6, 1e15  # of Young's modulus [Pa]
ROUNDED = 1e-6  # of the sum of the moments of inertia: what rounding may do to a matrix
THINNEST = 1e-9  # of the same: the least moment
LIGHTEST = 1e-36  # moment of inertia [kg m^2]: its inverse fits float32
LONGEST = 100.0  # of damping [s]: with more nothing swings, and the stages of damping grow


def _check_common(material) -> None:
    """Check that all fields are numbers, and density and damping possible ones."""
    for field in fields(material):
        checks.number(getattr(material, field.name), field.name)
    checks.number(material.density, "density", *DENSITY)
    checks.number(material.damping, "damping", 0.0, LONGEST)


@dataclass(frozen=True)
class _Solid:
    """Isotropic solid.

    Attributes:
        youngs_modulus: [Pa]
        poisson_ratio: [-], between -1 and 0.5
        density: [kg/m^3]
        damping: time beta [s] of stiffness-proportional damping; a mode of angular frequency w
            is damped by the ratio beta w / 2
    """

    youngs_modulus: float
    poisson_ratio: float
    density: float
    damping: float = 0.0

    def __post_init__(self):
        """As ``check``."""
        self.check()

    def check(self) -> None:
        """Raise ValueError if the numbers make no material."""
        _check_common(self)
        checks.number(self.youngs_modulus, "youngs_modulus", *STIFFNESS)
        ratio = checks.number(self.poisson_ratio, "poisson_ratio", -1.0, 0.5)
        if not -1.0 < ratio < 0.5:
            raise checks.refuse("poisson_ratio", ratio, "a number between -1 and 0.5")

    def lame(self) -> tuple[float, float]:
        """Return mu and lambda [Pa] of small strain."""
        e, nu = self.youngs_modulus, self.poisson_ratio
        return e / (2.0 * (1.0 + nu)), e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))

    def parameters(self, vertices: np.ndarray, tets: np.ndarray) -> np.ndarray:
        """Return (mu [Pa], lambda [Pa], beta [s]) of each tet, shape (n, 3)."""
        row = np.array([*self.lame(), self.damping], dtype=np.float32)
        return np.tile(row, (len(tets), 1))


@dataclass(frozen=True)
class NeoHookean(_Solid):
    __doc__ = f"Stable neo-Hookean: {_Solid.__doc__}"
    kernels: ClassVar[ModuleType] = neo_hookean


@dataclass(frozen=True)
class Corotated(_Solid):
    __doc__ = f"Fixed corotated: {_Solid.__doc__}"
    kernels: ClassVar[ModuleType] = corotated


@dataclass(frozen=True)
class SpringNetwork:
    """Springs on tet edges, surface triangles and tets; each stores k C^2 / 2 at strain C.

    The constants belong to one spring, so a finer mesh of the same body is stiffer.

    Attributes:
        distance: energy k of each tet edge [J]
        area: energy k of each surface triangle [J]
        volume: energy k of each tet [J]
        density: [kg/m^3]
        damping: time beta [s] of stiffness-proportional damping
    """

    distance: float
    area: float
    volume: float
    density: float
    damping: float = 0.0
    kernels: ClassVar[ModuleType] = springs

    def __post_init__(self):
        """As ``check``."""
        self.check()

    def check(self) -> None:
        """Raise ValueError if the numbers make no material."""
        _check_common(self)
        for name in ("distance", "area", "volume"):
            checks.number(getattr(self, name), name, least=0.0)

    def parameters(self, vertices: np.ndarray, tets: np.ndarray) -> np.ndarray:
        """Return the row described in ``elastic/springs.py`` for each tet, shape (n, 22)."""
        x = np.asarray(vertices, dtype=np.float64)[np.asarray(tets)]  # (n, 4, 3)
        d = np.stack([x[:, j] - x[:, i] for i, j in EDGES], axis=1)
        abc = np.stack([x[:, face] for face in map(list, OPPOSITE)], axis=1)  # (n, 4, 3, 3)
        normal = np.cross(abc[:, :, 1] - abc[:, :, 0], abc[:, :, 2] - abc[:, :, 0])
        shared = _multiplicity(tets, OPPOSITE) > 1
        row = [
            self.distance / _multiplicity(tets, EDGES),
            np.linalg.norm(d, axis=-1),
            np.where(shared, 0.0, self.area),
            0.5 * np.linalg.norm(normal, axis=-1),
            np.full((len(tets), 1), self.volume),
            np.full((len(tets), 1), self.damping),
        ]
        return np.concatenate(row, axis=1).astype(np.float32)


@dataclass(frozen=True)
class Rigid:
    """A body that does not deform; it makes all steps of its scene implicit.

    With a density it has mass, centre and moments of inertia of a solid that fills its mesh. Else
    all three are given, as in ``Rigid(mass=2.0, centre=(0, 0, 0), inertia=np.diag([1, 2, 2]))``.
    All its velocities are a rigid motion: others that are set become the nearest one in the next
    frame. While fixed, its vertices follow the velocities that they are given.

    Attributes:
        density: [kg/m^3]
        mass: [kg]
        centre: of mass, in the frame of the mesh [m], shape (3,)
        inertia: about the centre, in the same frame [kg m^2], shape (3, 3)
    """

    density: float | None = None
    _: KW_ONLY
    mass: float | None = None
    centre: tuple | None = None
    inertia: tuple | None = None
    damping: ClassVar[float] = 0.0
    kernels: ClassVar[ModuleType | None] = None

    def __post_init__(self):
        """As ``check``; what is given is kept as numbers, which cannot be changed."""
        self.check()
        if self.density is None:
            object.__setattr__(self, "centre", tuple(np.array(self.centre, dtype=float).tolist()))
            rows = np.array(self.inertia, dtype=float).tolist()
            object.__setattr__(self, "inertia", tuple(map(tuple, rows)))

    def check(self) -> None:
        """Raise ValueError if the numbers make no body."""
        given = [n for n in ("mass", "centre", "inertia") if getattr(self, n) is not None]
        if self.density is not None:
            checks.number(self.density, "density", *DENSITY)
            if given:
                raise checks.refuse(given[0], getattr(self, given[0]), "it, or a density")
            return
        if len(given) < 3:
            raise ValueError("a rigid body: give a density, or mass, centre and inertia")
        checks.positive(self.mass, "mass")
        checks.numbers(self.centre, (3,), "centre", HUGE)
        _check_inertia(checks.numbers(self.inertia, (3, 3), "inertia"))

    def solid(self, vertices: np.ndarray, tets: np.ndarray) -> Solid:
        """What a body of a mesh weighs."""
        if self.density is None:
            return Solid(float(self.mass), np.array(self.centre), np.array(self.inertia))
        volume = signed_volumes(vertices, tets)
        origin = vertices.mean(axis=0)
        x = (vertices - origin)[tets]
        total, sums = volume.sum(), x.sum(axis=1)
        centre = (volume[:, None] * sums).sum(axis=0) / (4.0 * total)
        x, sums = x - centre, sums - 4.0 * centre
        # Of a tet of volume V: V / 20 (sum of x x^T + (sum of x) (sum of x)^T).
        second = np.einsum("q,qki,qkj->ij", volume, x, x) + (volume[:, None] * sums).T @ sums
        second *= self.density / 20.0
        inertia = np.trace(second) * np.eye(3) - second
        return Solid(self.density * total, origin + centre, inertia)


def _check_inertia(inertia: np.ndarray) -> None:
    """Raise ValueError for what is no inertia of anything."""
    total = np.abs(np.trace(inertia))
    if np.abs(inertia - inertia.T).max() > ROUNDED * total:
        raise checks.refuse("inertia", inertia.tolist(), "a symmetric matrix")
    a, b, c = np.linalg.eigvalsh(inertia)
    wanted = f"main moments above 0, here they are {a:.3g}, {b:.3g}, {c:.3g}"
    if a <= max(THINNEST * total, LIGHTEST):
        raise checks.refuse("inertia", inertia.tolist(), wanted)
    if c > a + b + ROUNDED * total:
        wanted = f"main moments of which none is above the sum of the others, not {c:.3g}"
        raise checks.refuse("inertia", inertia.tolist(), f"{wanted} with {a:.3g} and {b:.3g}")


def _multiplicity(tets: np.ndarray, parts: tuple) -> np.ndarray:
    """Number of tets that share each edge or face of each tet, shape (n, len(parts))."""
    ids = np.sort(np.asarray(tets)[:, np.array(parts)], axis=-1)
    rows = ids.reshape(-1, ids.shape[-1])
    _, inverse, count = np.unique(rows, axis=0, return_inverse=True, return_counts=True)
    return count[inverse.ravel()].reshape(len(tets), len(parts))
