"""Cases in which bodies press on each other."""

from collections.abc import Callable
from unittest import mock

import warp as wp
from checks import surface as stage_4
from verification import ladder, springs
from verification import weight as static
from verification.setup import Ask, Pose

import warp_contact as wc
from warp_contact import impulse
from warp_contact.kernels import impulse as impulse_kernels

INSERTED = "energy that it puts in [J]"
PLACE = "place of the surface [% of the overlap]"
PRESSED = "contact force [of the exact one]"
CARRIED = "mean force [of the weight]"
SWEEPS = "sweeps of the impulses in a step"


def overlapping() -> dict[str, float]:
    """Stage 4, overlap of 10 %, 1:10."""
    rows = stage_4.place("", "balanced", wc.Corotated, 0.0, (3, 4), 10.0)
    figure = "surface of the lower block [% of overlap]"
    return {PLACE: abs(next(row.value for row in rows if row.figure == figure))}


def deep() -> dict[str, float]:
    """Blocks that start 60 % inside."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.3)
    for k in range(2):
        place = 0.013 * k, 0.007 * k, 0.04 * k
        scene.add_body(wc.box(0.1, 4), wc.NeoHookean(5e4, 0.3, 1000.0, 1e-3), place)
    sim = wc.Simulation(scene)
    return {INSERTED: max(sim.measure().energy for _ in sim.frames(20))}


def columns() -> dict[str, float]:
    """A1 columns, damped, at rest."""
    pressed = springs.press(
        "", springs.CASES["equal"], Ask(), 4, "structured", Pose(), springs.DAMPED
    )
    return {PRESSED: abs(next(pressed).error)}


def heavy() -> dict[str, float]:
    """A7m heavy on light, mass ratio 100."""
    return {CARRIED: abs(next(ladder.carry(Ask(), 100.0)).error)}


def sheet() -> dict[str, float]:
    """A7 block on a membrane."""
    sweeps, steps, flag = (wp.zeros(1, dtype=int) for _ in range(3))

    def counting(function: Callable, number: wp.array) -> Callable:
        def called(*args) -> None:
            function(*args)
            wp.launch(impulse_kernels.next_sweep, dim=1, inputs=[False], outputs=[flag, number])

        return called

    with (
        mock.patch.multiple(static, SETTLE=0.3, SAMPLE=0.1),
        mock.patch.object(impulse, "next_sweep", counting(impulse.next_sweep, sweeps)),
        mock.patch.object(impulse, "record_vertices", counting(impulse.record_vertices, steps)),
    ):
        list(static.on_sheet("", Ask()))
    return {SWEEPS: float(sweeps.numpy()[0] / steps.numpy()[0])}
