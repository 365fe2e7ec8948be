"""Run a task with many methods, one after the other."""

from collections.abc import Iterable, Iterator

from engines import ours, outside
from engines.settings import Own
from engines.task import Failed, Motion, Task

Run = tuple[str, str, Motion | Failed]  # method, its knobs as text, what came of it


def runs(
    task: Task, own: Iterable[Own], others: dict[str, list[dict]], python: str, limit: float
) -> Iterator[Run]:
    """Every setting of this package and of the engines outside.

    Args:
        task: what to run
        own: settings of this package; steps are multiples of those that a method takes by itself
        others: settings of each engine outside
        python: interpreter that has these
        limit: wall seconds after which one run is given up
    """
    steps: dict[tuple, int] = {}
    for setting in own:
        alike = setting.method, setting.times
        try:
            if setting.factor == 1:
                motion = ours.run(task, setting, None, limit)
                steps[alike] = motion.steps
            elif alike in steps:
                motion = ours.run(task, setting, setting.factor * steps[alike], limit)
            else:
                raise Failed("no run with steps x1")
        except Failed as failed:
            motion = failed
        yield setting.method, str(setting), motion
    for engine, settings in others.items():
        motions = outside.run(task, engine, settings, python, limit)
        for setting, motion in zip(settings, motions, strict=True):
            yield engine, ", ".join(f"{k} {value:g}" for k, value in setting.items()), motion
