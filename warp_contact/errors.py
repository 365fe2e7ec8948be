"""What a run or a command can fail with."""


class SimulationError(RuntimeError):
    """A run cannot continue, for example because its state is no longer finite."""


class UsageError(ValueError):
    """The command line asked for something impossible."""
