"""A timer of every operation of a step, which runs uncaptured meanwhile.

The stage of an operation is the module of ``warp_contact/step`` that asks for it, the innermost
one. A launch counts net of the same launch without a thread, a memory operation net of the same on
one element, both just before it: what remains is the work itself, without Python. On the CPU the
clock is that of the thread, which stands still while others have the core.
"""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import fields, is_dataclass
from time import perf_counter, thread_time
from traceback import walk_stack
from unittest import mock

import warp as wp

ROOM = "warp_contact.step."
OTHER = "other"  # asked for outside of a step
ALONE = "step_alone"  # by step.py itself; "step" is the whole
MEMORY = {  # with the same where there is next to nothing to do
    (wp, "copy"): lambda one, other, tree: wp.copy(one, other),
    (wp.array, "zero_"): lambda one, other, tree: one.zero_(),
    (wp.array, "fill_"): lambda one, other, tree: one.fill_(1),
    (wp.utils, "array_scan"): lambda one, other, tree: wp.utils.array_scan(one, other),
    (wp.Bvh, "refit"): lambda one, other, tree: tree.refit(),
}


class StageTimer(ExitStack):
    """Keeps stage and time [ms] of every operation while it is entered, as ``operations``.

    The stage is a module of ``warp_contact/step``, or ``OTHER``.
    """

    def __init__(self, device: wp.Device):
        """``device`` is that of the step."""
        super().__init__()
        self.operations: list[tuple[str, float]] = []
        self._device, self._inside = device, False
        one, other = (wp.zeros(1, dtype=int, device=device) for _ in range(2))
        tree = wp.Bvh(*(wp.zeros(1, dtype=wp.vec3, device=device) for _ in range(2)))
        self._few = one, other, tree

    def __enter__(self):
        """Put the timer between the step and Warp."""
        timed = {(wp, "launch"): self._launch(wp.launch)}
        for (owner, name), small in MEMORY.items():
            timed[owner, name] = self._operation(getattr(owner, name), small)
        for place, function in timed.items():
            self.enter_context(mock.patch.object(*place, function))
        return self

    def _launch(self, launch):
        def call(kernel, *args, **kwargs):
            command = launch(kernel, *args, record_cmd=True, **kwargs)
            if command is None:  # no thread to run
                return
            bounds = command.params[0]
            command.set_dim(0)
            command.launch()
            empty = milliseconds(self._device, command.launch)
            command.params[0] = bounds
            self._note(milliseconds(self._device, command.launch) - empty)

        return call

    def _operation(self, function, small):
        def call(*args, **kwargs):
            if self._inside:  # one operation may be made of others
                return function(*args, **kwargs)
            self._inside = True
            small(*self._few)
            empty = milliseconds(self._device, small, *self._few)
            ms = milliseconds(self._device, function, *args, **kwargs)
            self._inside = False
            self._note(ms - empty)

        return call

    def _note(self, ms: float) -> None:
        self.operations.append((_stage(), ms))


def milliseconds(device: wp.Device, function, *args, **kwargs) -> float:
    """Time of a call and of what it asks of the device [ms]."""
    clock = thread_time if device.is_cpu else perf_counter
    start = clock()
    function(*args, **kwargs)
    if not device.is_cpu:
        wp.synchronize_device(device)
    return 1e3 * (clock() - start)


def _stage() -> str:
    modules = (frame.f_globals.get("__name__", "") for frame, _ in walk_stack(None))
    stage = next((m.removeprefix(ROOM) for m in modules if m.startswith(ROOM)), OTHER)
    return ALONE if stage == "step" else stage


def arrays(holder) -> Iterator[wp.array]:
    """All arrays in a dataclass, a Warp struct or a tuple of these."""
    if isinstance(holder, wp.array):
        yield holder
    elif is_dataclass(holder):
        yield from arrays(tuple(getattr(holder, field.name) for field in fields(holder)))
    elif isinstance(holder, tuple):
        for item in holder:
            yield from arrays(item)
    elif hasattr(holder, "_cls"):  # an instance of a wp.struct
        yield from arrays(tuple(getattr(holder, name) for name in holder._cls.vars))


def held(*holders) -> int:
    """Bytes of all their arrays; what several of them share counts once."""
    total, last = 0, 0
    for a in sorted(arrays(holders), key=lambda a: a.ptr or 0):
        end = (a.ptr or 0) + a.size * wp.types.type_size_in_bytes(a.dtype)
        total += max(0, end - max(a.ptr or 0, last))
        last = max(last, end)
    return total
