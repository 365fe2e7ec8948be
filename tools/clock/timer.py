"""A timer of every operation of a step, which runs uncaptured meanwhile.

The stage of an operation is the module of ``warp_contact/step`` that asks for it, the innermost
one. On the CPU a launch counts net of the same launch without a thread, a memory operation net of
the same on one element, both just before it: what remains is the work itself, without Python. The
clock is that of the thread, which stands still while others have the core. On a GPU two events
enclose each operation.
"""

import sys
from time import thread_time
from typing import NamedTuple

import warp as wp

from clock.memory import held

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


class Operation(NamedTuple):
    """One operation.

    Attributes:
        stage: a module of ``warp_contact/step``, or ``OTHER``
        name: of the kernel or memory operation
        bytes: of the arrays that it was given, what several of them share once
        ms: its time
    """

    stage: str
    name: str
    bytes: int
    ms: float


class StageTimer:
    """Keeps a record of every operation while it is entered, in order, as ``operations``."""

    def __init__(self, device: wp.Device):
        """``device`` is that of the step."""
        self.operations: list[Operation] = []
        self._cpu = device.is_cpu
        self._device = device
        self._inside = False
        self._kept: list = []
        self._events: list = []
        one, other = (wp.zeros(1, dtype=int, device=device) for _ in range(2))
        tree = wp.Bvh(*(wp.zeros(1, dtype=wp.vec3, device=device) for _ in range(2)))
        self._few = one, other, tree

    def __enter__(self):
        """Put the timer between the step and Warp."""
        for (owner, name), small in MEMORY.items():
            self._replace(owner, name, self._operation(name, getattr(owner, name), small))
        self._replace(wp, "launch", self._launch(wp.launch))
        return self

    def __exit__(self, *error):
        """Take the timer out again and read the events."""
        for owner, name, function in reversed(self._kept):
            setattr(owner, name, function)
        self._kept.clear()
        wp.synchronize_device(self._device)
        for k, begin, end in self._events:
            ms = wp.get_event_elapsed_time(begin, end)
            self.operations[k] = self.operations[k]._replace(ms=ms)
        self._events.clear()

    def _replace(self, owner, name: str, function) -> None:
        self._kept.append((owner, name, getattr(owner, name)))
        setattr(owner, name, function)

    def _launch(self, launch):
        def call(kernel, *args, **kwargs):
            size = held((*kwargs.get("inputs", ()), *kwargs.get("outputs", ())))
            if not self._cpu:
                self._enclose(kernel.key, size, lambda: launch(kernel, *args, **kwargs))
                return
            command = launch(kernel, *args, record_cmd=True, **kwargs)
            if command is None:  # no thread to run
                return
            bounds = command.params[0]
            command.set_dim(0)
            command.launch()
            empty = _ms(command.launch)
            command.params[0] = bounds
            self._note(kernel.key, size, _ms(command.launch) - empty)

        return call

    def _operation(self, name: str, function, small):
        def call(*args, **kwargs):
            if self._inside:  # one operation may be made of others
                return function(*args, **kwargs)
            self._inside = True
            try:
                if self._cpu:
                    small(*self._few)
                    empty = _ms(lambda: small(*self._few))
                    spent = _ms(lambda: function(*args, **kwargs)) - empty
                    self._note(name, held(args), spent)
                else:
                    self._enclose(name, held(args), lambda: function(*args, **kwargs))
            finally:
                self._inside = False

        return call

    def _note(self, name: str, size: int, ms: float) -> None:
        self.operations.append(Operation(_stage(), name, size, ms))

    def _enclose(self, name: str, size: int, function) -> None:
        begin, end = (wp.Event(self._device, enable_timing=True) for _ in range(2))
        wp.record_event(begin)
        function()
        wp.record_event(end)
        self._events.append((len(self.operations), begin, end))
        self._note(name, size, 0.0)


def _stage() -> str:
    frame = sys._getframe(1)
    while frame:
        module = frame.f_globals.get("__name__", "")
        if module.startswith(ROOM):
            return {"step": ALONE}.get(stage := module.removeprefix(ROOM), stage)
        frame = frame.f_back
    return OTHER


def _ms(function) -> float:
    start = thread_time()
    function()
    return 1e3 * (thread_time() - start)
