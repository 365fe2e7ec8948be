"""Motors of attachments as arrays."""

import numpy as np
import warp as wp

from warp_contact.data.tie_table import TieTable
from warp_contact.kernels.implicit.bodies import RigidMotion
from warp_contact.kernels.ties.motor import Motors

KEPT = "speed", "target", "place", "limit", "force", "lost", "sum"  # what a checkpoint needs


def allocate(table: TieTable, n_body: int) -> Motors:
    """None of them drives anything yet."""
    n, ties = len(table.body), np.diff(table.first)
    cluster = np.zeros(n, dtype=int)
    cluster[table.attachment] = table.cluster
    which = np.flatnonzero(np.isin(table.kind, ("hinge", "slider")))
    which = which[np.argsort(cluster[which], kind="stable")]
    number = np.bincount(cluster[which], minlength=len(ties))
    motors = Motors()
    motors.which = wp.array(which, dtype=int)
    motors.first, motors.row, motors.block = (
        wp.array(np.concatenate([[0], np.cumsum(sizes)]), dtype=int)
        for sizes in (number, number * ties, number**2)
    )
    motors.y, motors.z = (wp.zeros(int(number @ ties), dtype=wp.vec3d) for _ in range(2))
    motors.w = wp.zeros(int(number @ number), dtype=wp.float64)
    motors.axis, motors.at = (wp.zeros(n, dtype=wp.vec3) for _ in range(2))
    motors.turns = wp.array([int(kind == "hinge") for kind in table.kind], dtype=int)
    motors.mark, motors.toward = (
        wp.array(a, dtype=t) for a, t in ((table.marks, wp.vec2i), (table.toward, wp.vec3))
    )
    motors.turned = wp.array(table.turned, dtype=float)
    scalars = "speed", "target", "place", "limit", "force", "p", "to", "lacks", "reached", "lost"
    for name in scalars:
        setattr(motors, name, wp.zeros(n, dtype=float))
    motors.sum = wp.zeros(n, dtype=wp.float64)
    motors.by = RigidMotion()
    motors.by.v, motors.by.w = (wp.zeros(n_body, dtype=wp.vec3) for _ in range(2))
    return motors


def arrays(motors: Motors) -> dict[str, wp.array]:
    """What lasts from frame to frame, by its name."""
    return {name: getattr(motors, name) for name in KEPT}
