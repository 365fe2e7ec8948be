"""What a run can fail with."""


class SimulationError(RuntimeError):
    """A run cannot go on, for example because its state is no longer finite."""
