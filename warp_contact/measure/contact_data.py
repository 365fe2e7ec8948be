"""Contacts and contact forces as data: of the last step, and of the last frame."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from warp_contact.data.state import State
from warp_contact.data.work import Work


class PairForce(NamedTuple):
    """Mean contact force of a frame on the first body of a pair; the second gets the opposite.

    Attributes:
        normal: across the surfaces [N], shape (3,)
        friction: along them [N], shape (3,)
        point: where the normal force acts: mean of the contacts, by their normal impulses [m]
    """

    normal: np.ndarray
    friction: np.ndarray
    point: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """Both [N], shape (3,)."""
        return self.normal + self.friction


class PairForces(dict[tuple[str, str], PairForce]):
    """Forces of the pairs that touched, by the labels of both, in the order of ``names``.

    A pair that is asked for in the other order is found too, with its forces turned round.
    """

    def __init__(self, names: list[str]):
        """No pair touched yet."""
        super().__init__()
        self._names = names

    def __missing__(self, pair: tuple[str, str]) -> PairForce:
        """That of the pair in the other order; KeyError where it did not touch."""
        first, second = pair
        for name in pair:
            if name not in self._names:
                known = ", ".join(self._names)
                raise KeyError(f"there is no body or plane '{name}': the scene has {known}")
        turned = dict.get(self, (second, first))
        if turned is None:
            raise KeyError(f"'{first}' and '{second}' did not touch: get(pair) gives None there")
        return PairForce(-turned.normal, -turned.friction, turned.point)

    def __contains__(self, pair: object) -> bool:
        """Whether a pair touched, in either order."""
        turned = pair[::-1] if isinstance(pair, tuple) else pair
        return super().__contains__(pair) or super().__contains__(turned)

    def get(self, pair, default=None):
        """The force of a pair, or ``default`` where it did not touch; KeyError for other labels."""
        return self[pair] if pair in self or set(pair) - set(self._names) else default


@dataclass(frozen=True)
class Contacts:
    """Contacts of the last step, of which the first body is a vertex or a point of an edge.

    Attributes:
        bodies: indices of both bodies, n_body + p for plane p, shape (n, 2)
        vertices: of all bodies, numbered through: two of the first body, three of the second; the
            same one more than once where a side has fewer, shape (n, 5)
        weights: of the vertices: the first side has 1, the second -1, on a plane 0; shape (n, 5)
        point: of the first body [m], shape (n, 3)
        normal: unit vector out of the second body, shape (n, 3)
        gap: along it, negative for an overlap [m], shape (n,)
        normal_impulse: along it on the first body, in the step [N s], shape (n,)
        friction_impulse: on the first body, in the step [N s], shape (n, 3)
        normal_force, friction_force: the same over the length of the step [N]
        slip: velocity of the first body against the second along the surface [m/s], shape (n, 3)
    """

    bodies: np.ndarray
    vertices: np.ndarray
    weights: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    gap: np.ndarray
    normal_impulse: np.ndarray
    friction_impulse: np.ndarray
    normal_force: np.ndarray
    friction_force: np.ndarray
    slip: np.ndarray

    def __len__(self):
        """Number of contacts."""
        return len(self.gap)


def contacts(state: State, work: Work, dt: np.ndarray) -> Contacts:
    """Those of the last step at the present positions; ``dt`` are the steps [s], (n_vert,)."""
    record, impulse = work.contacts.of_step()
    vert, coef, normal = record["vert"], record["coef"].astype(np.float64), record["normal"]
    at = state.x.numpy().astype(np.float64)[vert]
    u = np.einsum("ck,cki->ci", coef, state.v.numpy().astype(np.float64)[vert])
    h = dt[vert[:, :1]]
    along = np.einsum("ci,ci->c", u, normal)
    return Contacts(
        bodies=record["pair"].copy(),
        vertices=vert.copy(),
        weights=coef,
        point=np.einsum("ck,cki->ci", coef[:, :2], at[:, :2]),
        normal=normal.copy(),
        gap=np.einsum("ck,cki,ci->c", coef, at, normal) - record["offset"],
        normal_impulse=impulse["normal"].copy(),
        friction_impulse=impulse["friction"].copy(),
        normal_force=impulse["normal"] / h[:, 0],
        friction_force=impulse["friction"] / h,
        slip=u - along[:, None] * normal,
    )


def pair_forces(names: list[str], work: Work, duration: float) -> PairForces:
    """Of each pair that touched in the last ``duration`` [s], by their labels, in their order."""
    key = work.forces.pair_key.numpy()
    total = work.forces.pair_total.numpy() * work.forces.unit
    out = PairForces(names)
    for k in np.argsort(key):
        if key[k] >= 0 and duration > 0.0:
            both, friction, size, moment = np.split(total[k], [3, 6, 7])
            force = (both - friction) / duration, friction / duration
            point = moment / size if size else np.full(3, np.nan)
            pair = names[key[k] >> 32], names[key[k] & 0xFFFFFFFF]
            out[pair] = PairForce(*force, point)
    return out


def force_on(vertices: np.ndarray, work: Work, duration: float) -> np.ndarray:
    """Mean contact force of the last ``duration`` [s] on ``vertices`` together [N], shape (3,)."""
    received = work.forces.received.numpy()[vertices].astype(np.float64)
    return received.sum(axis=0) / duration if duration > 0.0 else np.zeros(3)
