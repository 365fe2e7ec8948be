"""A timer for the stages of a step, which runs uncaptured meanwhile.

Every kernel launch and memory operation inside ``with StageTimer(...) as timer`` goes to the stage
whose function is being called. On the CPU a launch counts net of the same launch without a thread,
a memory operation net of the same on one element, both just before it: what remains is the work
itself, without Python. The clock is that of the thread, which stands still while others have the
core. On a GPU two events enclose each operation.
"""

from time import thread_time

import warp as wp

from benching.memory import held
from warp_contact.step import broad_phase, impulse, step, surface

STAGES = {  # the functions of a stage; the outermost call counts
    "damping": ((step, "damp"),),
    "predict": ((step, "kick"), (step, "drift")),
    "candidates": ((broad_phase, "refresh"),),
    "vertex_contacts": ((step, "vertex_contacts"),),
    "edge_contacts": ((step, "edge_contacts"), (step, "hold_edges")),
    "impulses": (
        (step, "arrange"),
        (impulse, "recall"),
        (impulse, "exchange"),
        (impulse, "push"),
        (impulse, "push_apart"),
        (impulse, "keep"),
        (impulse, "keep_edges"),
        (impulse, "forget_edges"),
        (impulse, "record"),
    ),
    "closure": ((step, "move_surfaces"), (surface, "leftover")),
}
OTHER = "other"  # outside of them all
MEMORY = (
    (wp, "copy"),
    (wp.array, "zero_"),
    (wp.array, "fill_"),
    (wp.utils, "array_scan"),
    (wp.Bvh, "refit"),
)


class StageTimer:
    """Keeps a record of every operation while it is entered.

    Attributes:
        operations: stage and operation of each, in order; a kernel goes by its name
        ms: the time of each
        bytes: of the arrays that each was given, what several of them share once
    """

    def __init__(self, device: wp.Device):
        """``device`` is that of the step."""
        self.operations: list[tuple[str, str]] = []
        self.ms: list[float] = []
        self.bytes: list[int] = []
        self._device = device
        self._stage: str | None = None
        self._inside = False
        self._kept: list = []
        self._events: list = []
        self._small = _on_one_element() if device.is_cpu else {}

    def __enter__(self):
        """Put the timer between the step and Warp."""
        for stage, functions in STAGES.items():
            for owner, name in functions:
                self._replace(owner, name, self._staged(stage, getattr(owner, name)))
        for owner, name in MEMORY:
            self._replace(owner, name, self._operation(name, getattr(owner, name)))
        self._replace(wp, "launch", self._launch(wp.launch))
        return self

    def __exit__(self, *error):
        """Take the timer out again and read the events."""
        for owner, name, function in reversed(self._kept):
            setattr(owner, name, function)
        self._kept.clear()
        wp.synchronize_device(self._device)
        for k, begin, end in self._events:
            self.ms[k] = wp.get_event_elapsed_time(begin, end)
        self._events.clear()

    def _replace(self, owner, name: str, function) -> None:
        self._kept.append((owner, name, getattr(owner, name)))
        setattr(owner, name, function)

    def _staged(self, stage: str, function):
        def call(*args, **kwargs):
            if self._stage is not None:
                return function(*args, **kwargs)
            self._stage = stage
            try:
                return function(*args, **kwargs)
            finally:
                self._stage = None

        return call

    def _launch(self, launch):
        def call(kernel, *args, **kwargs):
            size = held((*kwargs.get("inputs", ()), *kwargs.get("outputs", ())))
            if not self._device.is_cpu:
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
            self._count(kernel.key, size, _ms(command.launch) - empty)

        return call

    def _operation(self, name: str, function):
        def call(*args, **kwargs):
            if self._inside:  # one operation may be made of others
                return function(*args, **kwargs)
            self._inside = True
            size = held(args)
            try:
                if self._device.is_cpu:
                    self._small[name]()
                    empty = _ms(self._small[name])
                    self._count(name, size, _ms(lambda: function(*args, **kwargs)) - empty)
                else:
                    self._enclose(name, size, lambda: function(*args, **kwargs))
            finally:
                self._inside = False

        return call

    def _count(self, operation: str, size: int, ms: float) -> None:
        self.operations.append((self._stage or OTHER, operation))
        self.bytes.append(size)
        self.ms.append(ms)

    def _enclose(self, operation: str, size: int, function) -> None:
        begin, end = (wp.Event(self._device, enable_timing=True) for _ in range(2))
        wp.record_event(begin)
        function()
        wp.record_event(end)
        self._events.append((len(self.ms), begin, end))
        self._count(operation, size, 0.0)


def _ms(function) -> float:
    start = thread_time()
    function()
    return 1e3 * (thread_time() - start)


def _on_one_element() -> dict:
    """Each memory operation where there is next to nothing to do."""
    one, other = (wp.zeros(1, dtype=int, device="cpu") for _ in range(2))
    tree = wp.Bvh(*(wp.zeros(1, dtype=wp.vec3, device="cpu") for _ in range(2)))
    return {
        "copy": lambda: wp.copy(one, other),
        "zero_": lambda: one.zero_(),
        "fill_": lambda: one.fill_(1),
        "array_scan": lambda: wp.utils.array_scan(one, other, inclusive=True),
        "refit": lambda: tree.refit(),
    }
