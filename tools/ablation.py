"""Switch off one part of the default method at a time: what gets worse, and by how much.

    python tools/ablation.py [part ...]

A line for each part: the case that needs it, a figure of that case with the part and without, and
without over with. A figure is an error, or a time, so that less is better; ``least`` is what it is
known to, and counts where the figure is less. A part earns its place where its line says at least
1.5. The exit status is 1 when one does not: it is to be removed. Times are the best of some runs.

The parts are switched off here, from outside; none is an option of the package. What cannot be
reached like that, because it is inside a kernel, is not in the table. Nor is what cannot be left
out: stage 1, the impulses of stage 5, and stage 3, which only says where stage 4 has to look.
"""

import argparse
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from time import process_time
from unittest import mock

import numpy as np
import warp as wp
from checks import collision
from checks import surface as stage_4
from verification import collision as free
from verification import springs, stack
from verification import weight as static
from verification.setup import Ask, Pose, on_face

import warp_contact as wc
from warp_contact import candidates, depth, forces, impulse, simulation, solver, surface
from warp_contact.kernels import impulse as impulse_kernels

WORTH = 1.5  # without over with: a part below it is not worth its lines
TIMES = 3  # runs for a time
WIDTHS = 34, 33, 41, 9, 9, 9  # of the columns [characters]
COLUMNS = "part", "case", "figure", "with", "without", "ratio"


@dataclass(frozen=True)
class Part:
    """What is switched off, and who misses it.

    Attributes:
        name: of the part
        off: a context in which it is off
        case: a function of this module that returns figures by name
        figure: of that case
        least: what the figure is known to, from rounding or from chance
    """

    name: str
    off: Callable
    case: Callable[[], dict[str, float]]
    figure: str
    least: float


@dataclass(frozen=True)
class Line:
    """One line of the table."""

    part: Part
    kept: float
    off: float

    @property
    def ratio(self) -> float:
        """Without over with; a run that ends early or is not finite is infinitely worse."""
        if not math.isfinite(self.off):
            return math.inf
        return max(self.off, self.part.least) / max(self.kept, self.part.least)

    @property
    def worth(self) -> bool:
        """Whether the part earns its place."""
        return self.ratio >= WORTH

    def __str__(self):
        """Its columns."""
        numbers = (f"{x:.3g}" for x in (self.kept, self.off, self.ratio))
        cells = self.part.name, name(self.part.case), self.part.figure, *numbers
        line = "  ".join(c.ljust(w) for c, w in zip(cells, WIDTHS, strict=True))
        return line + ("" if self.worth else "WORSENS NOTHING")


def main() -> int:
    """Print the table as it comes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="part", help=f"of {', '.join(PARTS)}; or all")
    args = parser.parse_args()
    unknown = set(args.parts) - set(PARTS)
    if unknown:
        parser.error(f"no part {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    wp.config.log_level = wp.LOG_WARNING
    print("  ".join(c.ljust(w) for c, w in zip(COLUMNS, WIDTHS, strict=True)).rstrip())
    useless = []
    for key in args.parts or PARTS:
        line = compare(PARTS[key])
        print(str(line).rstrip(), flush=True)
        if not line.worth:
            useless.append(line.part.name)
    if useless:
        print(f"\nTo be removed: {', '.join(useless)}.")
    return 1 if useless else 0


def compare(part: Part) -> Line:
    """Run the case of a part with and without it."""
    kept = figures(part.case)[part.figure]
    try:
        with part.off():
            off = part.case()[part.figure]
    except wc.SimulationError:
        off = math.inf
    return Line(part, kept, off)


@cache
def figures(case: Callable) -> dict[str, float]:
    """Those of a case with every part."""
    return case()


def name(case: Callable) -> str:
    """Of a case in the table."""
    return case.__doc__.splitlines()[0].rstrip(".")


# Cases: figures by name, each an error or a time.

OVERLAP = "deepest overlap [% of an edge]"
SPIN = "angular momentum [of sum m |x| |v|]"
INSERTED = "energy that it puts in [J]"
PLACE = "place of the surface [% of the overlap]"
PRESSED = "contact force [of the exact one]"
CARRIED = "force on the lowest [of the weight]"
APPROACH = "approach left [of that before]"
DRIFT = "drift of the energy in 1 s [of it]"
FLATTENED = "rest volume of a tet [of its least]"
TIME = "processor time of 20 frames [s]"
SWEEPS = "sweeps of the impulses in a step"


def tilted() -> dict[str, float]:
    """Collision of tilted blocks."""
    found = collision.collide(collision.build(3, 3, 1.0, "tilted"))
    return {OVERLAP: found[OVERLAP], SPIN: found["angular momentum change [of sum m |x| |v|]"]}


def oblique() -> dict[str, float]:
    """Oblique collision with friction."""
    found = {f.name: f.error for f in free.collide(Ask(), (3, 5), "oblique", 1.0)}
    return {SPIN: found["change of ang. momentum [of sum m |x| |v|]"]}


def struck(speed: float, young: float, fps: float, frames: int) -> dict[str, float]:
    """The overlap after a tilted block has struck another at ``speed`` [m/s]."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
    for k, q in enumerate(((0.0, 0.0, 0.0, 1.0), collision.quaternion(collision.ANGLES))):
        rubber = wc.NeoHookean(young, 0.3, 1000.0)
        place, v = (0.0, 0.0, 0.16 * k), (0.0, 0.0, -speed * k)
        scene.add_body(wc.box(0.1, 3), rubber, place, q, velocity=v)
    sim = wc.Simulation(scene, fps=fps)
    edge = float(sim.model.body_edge.numpy().min())
    worst = max(sim.measure().overlap for _ in sim.frames(frames))
    return {OVERLAP: 100.0 * worst / edge}


def hard() -> dict[str, float]:
    """Tilted block at 5 m/s."""
    return struck(5.0, 5e4, 240.0, 24)


def soft() -> dict[str, float]:
    """Soft tilted block at 2 m/s."""
    return struck(2.0, 2e4, 60.0, 12)


def thin() -> dict[str, float]:
    """Thin soft plates at 10 m/s."""
    scene, speed = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0), 10.0
    for k in range(2):
        mesh, rubber = wc.box((0.1, 0.1, 0.01), (4, 4, 1)), wc.NeoHookean(300.0, 0.3, 1000.0)
        place, v = (0.004 * k, 0.003 * k, 0.06 * k), (0.0, 0.0, -speed * k)
        scene.add_body(mesh, rubber, place, velocity=v)
    sim = wc.Simulation(scene)
    for _ in sim.frames(2):
        pass
    lower, upper = (float(sim.velocities(body)[:, 2].mean()) for body in scene.bodies)
    return {APPROACH: max(lower - upper, 0.0) / speed}


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


def stacked() -> dict[str, float]:
    """A1 stack of five cubes."""
    return {CARRIED: abs(next(stack.stand(Ask(), (4, 3), "structured", Pose())).error)}


def sheet() -> dict[str, float]:
    """A7 block on a membrane."""
    sweeps, steps, flag = (wp.zeros(1, dtype=int) for _ in range(3))

    def counting(function: Callable, number: wp.array) -> Callable:
        def called(*args) -> None:
            function(*args)
            wp.launch(impulse_kernels.next_sweep, dim=1, inputs=[], outputs=[flag, number])

        return called

    with (
        mock.patch.multiple(static, SETTLE=0.3, SAMPLE=0.1),
        mock.patch.object(impulse, "next_sweep", counting(impulse.next_sweep, sweeps)),
        mock.patch.object(impulse, "record", counting(impulse.record, steps)),
    ):
        list(static.on_sheet("", Ask()))
    return {SWEEPS: float(sweeps.numpy()[0] / steps.numpy()[0])}


def vibrating() -> dict[str, float]:
    """Free block, let go squeezed."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(wc.box(0.1, 3), wc.NeoHookean(5e4, 0.3, 1000.0))
    sim = wc.Simulation(scene)
    sim.state.x.assign(sim.positions() * np.float32([1.0, 1.0, 0.6]))
    energy = [sim.measure().energy for _ in sim.frames(60)]
    first, last = np.mean(energy[:10]), np.mean(energy[-10:])
    return {DRIFT: abs(float(last / first) - 1.0)}


def pulled() -> dict[str, float]:
    """Springs pulled to 2.5 lengths."""
    scene, mesh = wc.Scene(gravity=(0.0, 0.0, 0.0)), wc.box(0.1, 3)
    top, bottom = (on_face(mesh, 2, side) for side in (1, -1))
    v = np.where(top[:, None], (0.0, 0.0, 1.5), 0.0)
    springs_only = wc.SpringNetwork(1.0, 1.0, 1.0, 1000.0)
    scene.add_body(mesh, springs_only, velocity=v, fixed=top | bottom)
    sim = wc.Simulation(scene, fps=10)
    least = min(sim.measure().volume_ratio for _ in sim.frames(2))
    return {FLATTENED: 1.0 / least if least > 0.0 else math.inf}


def apart() -> dict[str, float]:
    """27 spheres that almost touch."""
    times, place = [], 0.1005 * np.stack(np.unravel_index(np.arange(27), (3, 3, 3)), axis=1)
    for _ in range(TIMES):
        scene, mesh = wc.Scene(gravity=(0.0, 0.0, 0.0)), wc.sphere(0.05, 80)
        for at in place:
            scene.add_body(mesh, wc.NeoHookean(5e4, 0.3, 1000.0), at)
        sim = wc.Simulation(scene)
        sim.step_frame()
        begin = process_time()
        for _ in sim.frames(20):
            pass
        times.append(process_time() - begin)
    return {TIME: min(times)}


# What is switched off.


def without(owner, attribute: str, new) -> Callable:
    """A context maker that puts ``new`` in the place of a function or constant of the package."""
    getattr(owner, attribute)
    return lambda: mock.patch.object(owner, attribute, new)


def without_repeats():
    """A context in which the stable step of the start of a frame is that of its end too."""
    return mock.patch.multiple(simulation, UNSTABLE=math.inf, UNSTABLE_DAMPED=math.inf)


def nothing(*args) -> None:
    """In the place of a stage."""


def no_crossings(model, x0, x, work, fresh) -> None:
    """In the place of ``solver.edge_contacts``."""
    work.n_crossing.zero_()


def by_mass(model, state, work, response, search, move=solver.move_surfaces) -> None:
    """In the place of ``solver.move_surfaces``: deep overlaps are left to the closure too."""
    move(model, state, work, response, False)


def unseen(model, state, work, response, search, move=solver.move_surfaces) -> None:
    """In the place of ``solver.move_surfaces``: after the closure it looks at edges alone."""
    with mock.patch.object(solver, "vertex_contacts", nothing):
        move(model, state, work, response, search)


def border_only(model, x, work, find=depth.hit_depths) -> None:
    """In the place of ``depth.hit_depths``: no layer behind the border."""
    with mock.patch.object(wp, "capture_while", nothing):
        find(model, x, work)


def without_couple(model, x, v, work, search, close=surface.close) -> None:
    """In the place of ``surface.close``: what it hands back to ``v`` goes to a scratch array."""
    close(model, x, work.v, work, search)


def straight(model, x0, work, first, begin=impulse.begin) -> None:
    """In the place of ``impulse.begin``: friction acts across gaps as if they were closed."""
    begin(model, x0, work, first)
    work.contacts.open.zero_()


def plain(kernel, *args, launch=wp.launch, **kwargs) -> None:
    """In the place of ``wp.launch``: every sweep of the impulses is a plain one, like the last."""
    if kernel is impulse_kernels.solve_contacts:
        kwargs["inputs"] = [*kwargs["inputs"][:-1], True]
    launch(kernel, *args, **kwargs)


def damp_last(model, state, work, stages) -> None:
    """In the place of ``solver.predict``: the forces first."""
    solver.kick(model, state, work)
    if stages > 0:
        scratch = work.v, work.s
        forces.damp(model, state.x, state.v, work.dt, work.f_tet, scratch, stages)
    solver.drift(model, state, work, work.x)


def found_anew(model, x0, x1, work, refresh=candidates.refresh) -> None:
    """In the place of ``candidates.refresh``: all that was found is out of date."""
    work.candidates.x.fill_(wp.vec3(math.inf))
    refresh(model, x0, x1, work)


FINEST = 100.0 * surface.TOLERANCE  # % of an edge: an overlap that is left on purpose
ROUNDED = 1e-6  # of the angular momentum: a walk of float32 over a thousand steps
FORCE = 1e-5  # of a force: float32, and a sample of some frames
PARTS = {
    "edges": Part(
        "contacts of edges", without(solver, "edge_contacts", no_crossings), tilted, OVERLAP, FINEST
    ),
    "layers": Part(
        "depth behind the border (stage 2)",
        without(depth, "hit_depths", border_only),
        deep,
        INSERTED,
        1e-3,
    ),
    "search": Part(
        "search for the surface (stage 4)",
        without(solver, "move_surfaces", by_mass),
        overlapping,
        PLACE,
        1.0,
    ),
    "bound": Part(
        "bound of a move in stage 4", without(surface, "BOUND", math.inf), deep, INSERTED, 1e-3
    ),
    "closure": Part("closure", without(surface, "close", nothing), tilted, OVERLAP, FINEST),
    "looks": Part("looks after the closure", without(solver, "LOOKS", 0), hard, OVERLAP, FINEST),
    "vertices": Part(
        "of these, the look at vertices",
        without(solver, "move_surfaces", unseen),
        hard,
        OVERLAP,
        FINEST,
    ),
    "couple": Part(
        "couple of the closure", without(surface, "close", without_couple), tilted, SPIN, ROUNDED
    ),
    "friction": Part(
        "couple of friction across a gap",
        without(impulse, "begin", straight),
        oblique,
        SPIN,
        ROUNDED,
    ),
    "warm": Part(
        "start from the last impulses", without(impulse, "recall", nothing), sheet, SWEEPS, 1.0
    ),
    "ahead": Part(
        "extrapolation of the sweeps", without(wp, "launch", plain), stacked, CARRIED, FORCE
    ),
    "damping": Part(
        "damping before the forces", without(solver, "predict", damp_last), columns, PRESSED, FORCE
    ),
    "skins": Part(
        "candidates kept for many steps",
        without(candidates, "refresh", found_anew),
        apart,
        TIME,
        0.0,
    ),
    "impact": Part(
        "shorter steps at an impact", without(simulation, "TRAVEL", math.inf), soft, OVERLAP, FINEST
    ),
    "thin": Part(
        "shorter steps for thin bodies",
        without(simulation, "REACH", math.inf),
        thin,
        APPROACH,
        0.01,
    ),
    "repeats": Part("frames repeated in shorter steps", without_repeats, pulled, FLATTENED, 1.0),
    "steady": Part(
        "steps that hardly grow again", without(simulation, "KEEP", 0.0), vibrating, DRIFT, 1e-3
    ),
}


if __name__ == "__main__":
    sys.exit(main())
