"""The attachments of a scene as a table, on the host."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class TieTable:
    """Attachments and their ties, see ``kernels/ties/tie.py``; cluster after cluster.

    Attributes:
        labels: of the attachments
        body: both bodies of each attachment, -1 for the world, shape (n_attachment, 2)
        limit: force that breaks it [N], shape (n_attachment,)
        kind: of each attachment, as it was asked for
        marks: a vertex of each body away from the axis of a hinge, -1 for the world, else -1,
            shape (n_attachment, 2)
        toward: from the axis of a hinge on the world to its mark at the start, (n_attachment, 3)
        turned: angle from the second mark to the first at the start [rad], shape (n_attachment,)
        attachment: whose each tie is, shape (n_tie,)
        cluster: its cluster, shape (n_tie,)
        first: first tie of each cluster, shape (n_cluster + 1,)
        vert, weight, along: vertices and weights of each tie, shape (n_tie, 8)
        axis, point: of ties to the world [m], shape (n_tie, 3)
        slides, to_world: whether it slides, and is one to the world, shape (n_tie,)
        compliance: of each tie [m/N], shape (n_tie,)
    """

    labels: tuple[str, ...]
    body: np.ndarray
    limit: np.ndarray
    kind: tuple[str, ...]
    marks: np.ndarray
    toward: np.ndarray
    turned: np.ndarray
    attachment: np.ndarray
    cluster: np.ndarray
    first: np.ndarray
    vert: np.ndarray
    weight: np.ndarray
    along: np.ndarray
    axis: np.ndarray
    point: np.ndarray
    slides: np.ndarray
    to_world: np.ndarray
    compliance: np.ndarray
