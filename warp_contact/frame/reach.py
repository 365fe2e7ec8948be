"""How far the step of implicit bodies lets anything move against a body.

A body that deforms lets it move by a part of its thickness (step_bounds.py): what a longer motion
leads into it or through it would crush its tets at once. One that does not, as a thin shell, only
has to be found by the swept test of ``kernels/narrow_phase/vertices.py``. That follows vertices,
and no edges: two thin bodies could pass each other edge by edge. So the motion is as short as for
the thinnest of the others, and no longer than an edge.
"""

import numpy as np

from warp_contact.data.model import Model
from warp_contact.frame.implicit_shapes import mobile
from warp_contact.frame.worlds import WorldIds
from warp_contact.kernels.implicit.bodies import RIGID


def reaches(model: Model, worlds: WorldIds, kind: np.ndarray) -> np.ndarray:
    """Lengths of which a part may be moved against each body in a step [m], shape (n_body,).

    ``kind`` is that of each body, see ``kernels/implicit/bodies.py``.
    """
    thickness, edge = (a.numpy().astype(float) for a in (model.body_thickness, model.body_edge))
    moves = mobile(model)
    others = np.where(
        moves,
        _least_of_others(thickness, worlds.of_body, np.full(len(moves), True)),
        _least_of_others(thickness, worlds.of_body, moves),  # two that are held never meet
    )
    stiff = ~moves | (kind == int(RIGID))
    return np.where(stiff, np.maximum(thickness, np.minimum(edge, others)), thickness)


def _least_of_others(size: np.ndarray, group: np.ndarray, among: np.ndarray) -> np.ndarray:
    """The least size of other bodies of the same group, those in the mask ``among``; or inf."""
    least, second = np.full((2, group.max(initial=0) + 1), np.inf)
    owner = np.full(len(least), -1)
    chosen = np.flatnonzero(among)
    order = chosen[np.lexsort((size[chosen], group[chosen]))]
    groups, first = np.unique(group[order], return_index=True)
    least[groups], owner[groups] = size[order[first]], order[first]
    has_two = np.append(group[order], -1)[first + 1] == groups
    second[groups[has_two]] = size[order[first[has_two] + 1]]
    return np.where(owner[group] == np.arange(len(size)), second[group], least[group])
