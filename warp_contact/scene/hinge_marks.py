"""What tells how far a hinge has turned: a vertex of each body, away from the axis."""

from collections.abc import Sequence

import numpy as np


def marks_of(attachments: Sequence, start: np.ndarray) -> dict[str, np.ndarray]:
    """The parts of the table of attachments; ``start`` is the first vertex of each body."""
    n = len(attachments)
    marks, toward, turned = np.full((n, 2), -1), np.zeros((n, 3)), np.zeros(n)
    for k, attachment in enumerate(attachments):
        if attachment.kind != "hinge":
            continue
        p, line = attachment.points[0], attachment.points[-1] - attachment.points[0]
        axis = line / np.linalg.norm(line)
        arms: list[np.ndarray] = []
        for side, body in enumerate((attachment.a, attachment.b)):
            if body is None:
                toward[k] = arms[0] / np.linalg.norm(arms[0])
                continue
            arm = body.x - p - np.outer((body.x - p) @ axis, axis)
            far = int(np.square(arm).sum(axis=1).argmax())
            marks[k, side] = start[body.index] + far
            arms.append(arm[far])
        if len(arms) == 2:
            turned[k] = np.arctan2(axis @ np.cross(arms[1], arms[0]), arms[1] @ arms[0])
    return {"marks": marks, "toward": toward, "turned": turned}
