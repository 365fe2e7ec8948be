"""Cases in which bodies press on each other."""

from collections.abc import Callable
from functools import partial
from unittest import mock

import warp as wp
from trials import loads, sweeps
from trials.watch import attempt
from verification import surface as stage_4
from verification import weight as static
from verification.setup import Ask

import warp_contact as wc
from warp_contact.kernels.impulse import impulse as impulse_kernels
from warp_contact.step import impulse

INSERTED = "energy that it puts in [J]"
RISE = "energy gained [of that stored]"
GAINED = "energy gained [of that at the start]"
PLACE = "place of the surface [% of the overlap]"
SWEEPS = "sweeps of the impulses in a step"


def overlapping() -> dict[str, float]:
    """Stage 4, overlap of 10 %, 1:10."""
    rows = stage_4.place("", "balanced", wc.Corotated, 0.0, (3, 4), 10.0)
    figure = "surface of the lower block [% of overlap]"
    return {PLACE: abs(next(row.value for row in rows if row.name == figure))}


def deep() -> dict[str, float]:
    """Blocks that start 60 % inside."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.3)
    for k in range(2):
        place = 0.013 * k, 0.007 * k, 0.04 * k
        scene.add_body(wc.box(0.1, 4), wc.NeoHookean(5e4, 0.3, 1000.0, 1e-3), place)
    sim = wc.Simulation(scene)
    return {INSERTED: max(sim.measure().energy for _ in sim.frames(20))}


def inserted() -> dict[str, float]:
    """A block that starts 0.3 edges inside one 0.4 edges thick."""
    build = partial(sweeps.SWEEPS["depth"].build, 0.3, 0.4)
    return {RISE: max(attempt(build, most_steps=1500).gained, 0.0)}


def dense() -> dict[str, float]:
    """Cube on a cube of a 10000th of its density."""
    case = next(c for c in loads.ratios(False) if "1:10000, heavy" in c.name)
    return {GAINED: max(attempt(case.build, "surface", limit=case.limit).gained, 0.0)}


def crushed() -> dict[str, float]:
    """Cube struck by one of 10^4 times its mass."""
    setting = loads.heavy(0.1, 5.0)
    sim = wc.Simulation(setting.scene, fps=setting.fps)
    start = sim.measure().energy
    frames = round(setting.seconds * setting.fps)
    most = max(sim.measure().energy for _ in sim.frames(frames))
    return {GAINED: max(most / start - 1.0, 0.0)}


def sheet() -> dict[str, float]:
    """A7 block on a membrane."""
    sweeps, steps, flag = (wp.zeros(1, dtype=int) for _ in range(3))

    def counting(function: Callable, number: wp.array) -> Callable:
        def called(*args, **kwargs) -> None:
            function(*args, **kwargs)
            wp.launch(impulse_kernels.next_sweep, dim=1, inputs=[False], outputs=[flag, number])

        return called

    with (
        mock.patch.multiple(static, SETTLE=0.3, SAMPLE=0.1),
        mock.patch.object(impulse, "_sweep", counting(impulse._sweep, sweeps)),
        mock.patch.object(impulse, "add_forces", counting(impulse.add_forces, steps)),
    ):
        list(static.on_sheet("", Ask()))
    return {SWEEPS: float(sweeps.numpy()[0] / steps.numpy()[0])}
