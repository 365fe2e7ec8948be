"""The contacts of a step, rebuilt in every step and shared by its stages."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from warp_contact.kernels.impulse.constraint import Constraint, Impulse
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.narrow_phase.contact_graph import ContactGraph

READ = "n", "n_vertex", "record", "impulse"  # what is read between frames


@dataclass
class KeptContacts:
    """Contacts that exchanged impulses in the last step, where a later look found others.

    Attributes:
        n: number of contacts, -1 where no later look did, shape (1,)
        record: of each, shape (capacity,)
        impulse: of the step, shape (capacity,)
    """

    n: wp.array[int]
    record: wp.array[Contact]
    impulse: wp.array[Impulse]


@dataclass
class Contacts:
    """Contacts of vertices first, then those of edges.

    All capacities are fixed; what does not fit is counted in ``overflow.py`` and never written.

    Attributes:
        n: number of contacts, shape (1,)
        n_vertex: number of those of vertices: one for each penetration, shape (1,)
        record: vertices, weights, direction and bodies of each, shape (capacity,)
        graph: the contacts of each vertex
        constraint: the constants of each in this step, shape (capacity,)
        impulse: of the step, shape (capacity,)
        part: what a sweep adds at each vertex of each contact [N s], shape (5 capacity,)
        kept: those to be read after the step
    """

    n: wp.array[int]
    n_vertex: wp.array[int]
    record: wp.array[Contact]
    graph: ContactGraph
    constraint: wp.array[Constraint]
    impulse: wp.array[Impulse]
    part: wp.array[wp.vec3]
    kept: KeptContacts

    def of_step(self) -> tuple[np.ndarray, np.ndarray]:
        """The contacts that exchanged impulses in the last step, and these."""
        n = int(self.kept.n.numpy()[0])
        record, impulse = self.record, self.impulse
        if n < 0:
            n = int(self.n.numpy()[0])
        else:
            record, impulse = self.kept.record, self.kept.impulse
        record, impulse = first(record, n), first(impulse, n)
        made = (record["coef"] != 0.0).any(axis=1)
        return record[made], impulse[made]


def allocate(n_vert: int, capacity: int, n_vertex: wp.array[int]) -> Contacts:
    """Allocate without any contact; the narrow phase counts ``n_vertex``."""
    graph = ContactGraph()
    graph.start = wp.zeros(n_vert + 1, dtype=int)
    graph.entry = wp.zeros(5 * capacity, dtype=int)
    graph.n_touched = wp.zeros(1, dtype=int)
    graph.touched = wp.zeros(n_vert, dtype=int)
    return Contacts(
        n=wp.zeros(1, dtype=int),
        n_vertex=n_vertex,
        record=wp.zeros(capacity, dtype=Contact),
        graph=graph,
        constraint=wp.zeros(capacity, dtype=Constraint),
        impulse=wp.zeros(capacity, dtype=Impulse),
        part=wp.zeros(5 * capacity, dtype=wp.vec3),
        kept=KeptContacts(
            n=wp.full(1, -1, dtype=int),
            record=wp.zeros(capacity, dtype=Contact),
            impulse=wp.zeros(capacity, dtype=Impulse),
        ),
    )


def copied(contacts: Contacts) -> tuple[dict[str, wp.array], KeptContacts]:
    """What is read of them between frames, in arrays of its own; what is kept only steps change."""
    return {name: wp.clone(getattr(contacts, name)) for name in READ}, contacts.kept


def copy(to: Contacts, of: tuple[dict[str, wp.array], KeptContacts]) -> None:
    """Put back what was ``copied``, also where buffers have been replaced; it fits."""
    found, kept = of
    for name, array in found.items():
        wp.copy(getattr(to, name), array, count=len(array))
    if to.kept is not kept:
        for name, array in vars(kept).items():
            wp.copy(getattr(to.kept, name), array, count=len(array))


def first(array: wp.array, n: int) -> np.ndarray:
    """Copies of the first ``n`` structs of an array; ``numpy()`` takes 0.1 ms."""
    kind = numpy_type(array.dtype)
    data = wp.array(ptr=array.ptr, dtype=wp.uint8, shape=n * kind.itemsize, device=array.device)
    return data.numpy().view(kind).copy()


@cache
def numpy_type(struct) -> np.dtype:
    """What a struct is to NumPy."""
    return np.dtype(struct.numpy_dtype())
