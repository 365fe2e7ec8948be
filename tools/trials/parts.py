"""The cases of ``tools/ablation.py``: each gets worse where some part of the method is off."""

import math
from collections.abc import Callable
from functools import partial
from time import process_time
from typing import NamedTuple
from unittest import mock

import numpy as np
import warp as wp
from verification import collision, surface, weight
from verification.setup import on_face

import warp_contact as wc
from trials import figures, limits, loads, sweeps
from trials.setting import NONE, Setting, body, scene, soft
from trials.watch import attempt
from warp_contact.kernels.lengths import CLOSURE_TOLERANCE
from warp_contact.kernels.motion import motion
from warp_contact.step import impulse


class Quantity(NamedTuple):
    """An error or a time: less is better."""

    name: str  # with its unit
    least: float  # what it is known to, from rounding or from chance


class Case(NamedTuple):
    """What is run, and what is measured in it."""

    title: str
    figure: Quantity
    run: Callable[[], float]


GAIN = 1e-3  # of the energy: what a pile of roundings and closures may add
LEFT = 100.0 * float(CLOSURE_TOLERANCE)  # % of an edge: an overlap that is left on purpose
ROUNDED = 1e-6  # of the angular momentum: a walk of float32 over a thousand steps
OVERLAP = Quantity("deepest overlap [% of an edge]", LEFT)
SPIN = Quantity("angular momentum [of sum m |x| |v|]", ROUNDED)
GAINED = Quantity("energy gained [of that at the start]", GAIN)
RISE = Quantity("energy gained [of that stored]", GAIN)
INSERTED = Quantity("energy that it puts in [J]", 1e-3)
DRIFT = Quantity("drift of the energy in 1 s [of it]", 1e-3)
APPROACH = Quantity("approach left [of that before]", 0.01)
FLATTENED = Quantity("rest volume of a tet [of its least]", 1.0)
PLACE = Quantity("place of the surface [% of the overlap]", 1.0)
STEPS = Quantity("steps of a frame", 1.0)
SWEEPS = Quantity("sweeps of the impulses in a step", 1.0)
TIME = Quantity("processor time of 20 frames [s]", 0.0)
TIMES = 3  # runs for a time
TURN = 0.1, 0.2, 0.0, 0.97  # about the x and y axes


def collide(figure: Quantity, scene: wc.Scene, steps: int = 0) -> float:
    """A collision of two blocks."""
    _, spin, _, overlap = collision.collide(scene, steps=steps).values()
    return spin if figure is SPIN else overlap


def gained(build: Callable[..., Setting], *arguments, most_steps: int = 10**9) -> float:
    """Energy of a case of ``tools/stability.py``."""
    return max(attempt(partial(build, *arguments), most_steps=most_steps).gained, 0.0)


def corner() -> float:
    """A step of a heavy cube on a light one."""
    light, heavy = soft(1e5, 1.0, 0.3), soft(1e5, 1e6, 0.3)
    low = body(wc.box(1.0, 1), light, fixed=np.arange(8) != 5)
    high = body(wc.box(0.3, 1), heavy, (-0.34, -0.34, 0.68), v=(5.0, 5.0, -45.0))
    sim = wc.Simulation(scene(low, high, gravity=NONE, friction=1.0), fps=1000, substeps=1)
    before = sim.measure().kinetic
    sim.step_frame()
    after = sim.measure()
    return max((after.kinetic + after.elastic) / before - 1.0, 0.0)


def thin() -> float:
    """How fast plates still approach each other that ought to part."""
    speed, plates = 20.0, []
    for k in range(2):
        place = 0.004 * k, 0.003 * k, 0.06 * k
        mesh = wc.box((0.1, 0.1, 0.01), (4, 4, 1))
        plates.append(body(mesh, soft(300.0, poisson=0.3), place, v=-speed * k))
    sim = wc.Simulation(scene(*plates, gravity=NONE, friction=0.0))
    for _ in sim.frames(2):
        pass
    lower, upper = (float(sim.velocities(k)[:, 2].mean()) for k in range(2))
    return max(lower - upper, 0.0) / speed


def overlapping() -> float:
    """Where the surface is that stage 4 finds."""
    rows = surface.place("", "balanced", wc.Corotated, 0.0, (3, 4), 10.0)
    figure = "surface of the lower block [% of overlap]"
    return abs(next(row.value for row in rows if row.name == figure))


def deep() -> float:
    """The largest energy; there is none at the start."""
    rubber = wc.NeoHookean(5e4, 0.3, 1000.0, 1e-3)
    places = (0.0, 0.0, 0.0), (0.013, 0.007, 0.04)
    two = scene(*(body(wc.box(0.1, 4), rubber, at) for at in places), gravity=NONE)
    sim = wc.Simulation(two)
    return max(sim.measure().energy for _ in sim.frames(20))


def pressed() -> float:
    """Steps of a frame in which two faces press a block to a twentieth of its height."""
    mesh, firm = wc.box(0.1, 3), wc.NeoHookean(1e6, 0.45, 1000.0)
    ends = np.abs(mesh.vertices[:, 2]) > 0.049
    sim = wc.Simulation(scene(body(mesh, firm, fixed=ends), gravity=NONE))
    sim.set_positions(0, mesh.vertices * [1.0, 1.0, 0.3])
    sim.set_velocity(0, (0.0, 0.0, -0.025 * sim.fps), ends & (mesh.vertices[:, 2] > 0.0))
    sim.step_frame()
    return sim.substeps


def sheet() -> float:
    """Sweeps and steps are counted as they run, downwards."""
    sweeps, steps, none = (wp.zeros(1, dtype=int) for _ in range(3))

    def counting(function: Callable, number: wp.array) -> Callable:
        def called(*args, **kwargs) -> None:
            function(*args, **kwargs)
            wp.launch(motion.count_down, dim=1, inputs=[none], outputs=[number])

        return called

    with (
        mock.patch.multiple(weight, SETTLE=0.3, SAMPLE=0.1),
        mock.patch.object(impulse, "_sweep", counting(impulse._sweep, sweeps)),
        mock.patch.object(impulse, "add_forces", counting(impulse.add_forces, steps)),
    ):
        list(weight.on_sheet(""))
    return float(sweeps.numpy()[0] / steps.numpy()[0])


def vibrating() -> float:
    """The mean energy of the last ten frames over that of the first ten."""
    block = scene(body(wc.box(0.1, 3), soft(5e4, poisson=0.3)), gravity=NONE)
    sim = wc.Simulation(block)
    sim.state.x.assign(sim.positions() * np.float32([1.0, 1.0, 0.6]))
    energy = [sim.measure().energy for _ in sim.frames(60)]
    first, last = np.mean(energy[:10]), np.mean(energy[-10:])
    return abs(float(last / first) - 1.0)


def pulled() -> float:
    """How flat a tet gets."""
    mesh = wc.box(0.1, 3)
    top, bottom = (on_face(mesh, 2, side) for side in (1, -1))
    v = np.where(top[:, None], (0.0, 0.0, 2.0), 0.0)
    block = body(mesh, wc.SpringNetwork(1.0, 1.0, 1.0, 1000.0), v=v, fixed=top | bottom)
    sim = wc.Simulation(scene(block, gravity=NONE), fps=10)
    least = min(sim.measure().volume_ratio for _ in sim.frames(2))
    return 1.0 / least if least > 0.0 else math.inf


def crowd() -> float:
    """The best time of some runs."""
    times, mesh = [], wc.sphere(0.05, 80)
    places = 0.1005 * np.stack(np.unravel_index(np.arange(27), (3, 3, 3)), axis=1)
    for _ in range(TIMES):
        balls = (body(mesh, soft(5e4, poisson=0.3), at) for at in places)
        sim = wc.Simulation(scene(*balls, gravity=NONE))
        sim.step_frame()
        begin = process_time()
        for _ in sim.frames(20):
            pass
        times.append(process_time() - begin)
    return min(times)


def thrown(figure: Quantity) -> float:
    """Blocks that meet obliquely."""
    return collide(figure, collision.thrown((3, 5), "oblique", 1.0), collision.STEPS)


def tilted(figure: Quantity, cells: int, place: str = "tilted", **turned) -> float:
    """A collision of equal blocks, the upper one tilted."""
    return collide(figure, collision.build(cells, cells, 1.0, place, **turned))


def parted() -> float:
    """Angular momentum of tilted blocks that the search leads apart; they start at rest."""
    blocks = body(wc.box(1.0, 2), soft()), body(wc.box(1.0, 3), soft(), (0.2, 0.1, 0.8), TURN)
    sim = wc.Simulation(scene(*blocks, gravity=NONE), fps=240)
    for _ in sim.frames(12):
        pass
    _, spin, _, scale = collision.motion(sim)
    return float(np.linalg.norm(spin)) / scale


def aside() -> float:
    """Of 24 random draws the clearest of three that need what this is to show."""
    angles, shift = (303.92, 141.27, 177.49), np.array([0.0177, -0.0439, 0.0])
    return tilted(OVERLAP, 5, "tilted shifted", angles=angles, shift=shift)


def rim(figure: Quantity, friction: float) -> float:
    """Of 200 random draws of 3:3 and 2:5 cells, one of six that need what this is to show."""
    angles, shift = (161.0, 219.0, 204.0), np.array([0.015, 0.019, 0.0])
    return tilted(figure, 3, "tilted shifted", friction=friction, angles=angles, shift=shift)


def case(title: str, figure: Quantity, run: Callable[..., float], *arguments, **named) -> Case:
    """The case whose figure is ``run(*arguments, **named)``."""
    return Case(title, figure, partial(run, *arguments, **named))


STRUCK = "Heavy corners over fixed ones of a light face with a free one, one step"
THICK = "A block that starts 0.3 edges inside one 0.4 edges thick"
CORNERS = case("Collision of tilted blocks", OVERLAP, tilted, OVERLAP, 3)
TURNED = case("Collision of tilted blocks", SPIN, tilted, SPIN, 3)
FINE = case("Collision of tilted blocks of 8 cells", OVERLAP, tilted, OVERLAP, 8)
ASIDE = Case("Tilted blocks of 5 cells, one aside", OVERLAP, aside)
RIM = case("Corner that comes in close to a rim", OVERLAP, rim, OVERLAP, 0.0)
ROUGH_RIM = case("Corner that comes in close to a rim, with friction", SPIN, rim, SPIN, 0.3)
OBLIQUE = case("Oblique collision with friction", SPIN, thrown, SPIN)
BALLS = case("Balls of 147 vertices, one falls on the other", GAINED, gained, limits.balls, 147)
PASSING = case("Corner that passes others tip on tip", GAINED, gained, figures.collide, 53)
BENT = case("Corner that slides up a bent face", GAINED, gained, figures.collide, 47)
DENSE = case("Cube on a cube of a 10000th of its density", GAINED, gained, loads.column, 1e4, 1.0)
THICK_PLATE = case(THICK, RISE, gained, sweeps.SWEEPS["depth"].build, 0.3, 0.4, most_steps=1500)
CORNER = Case(STRUCK, GAINED, corner)
THIN = Case("Thin soft plates at 20 m/s", APPROACH, thin)
OVERLAPPING = Case("Stage 4, overlap of 10 %, 1:10", PLACE, overlapping)
PARTED = Case("Tilted blocks that start inside each other", SPIN, parted)
DEEP = Case("Blocks that start 60 % inside", INSERTED, deep)
PRESSED = Case("Block pressed flat within a frame", STEPS, pressed)
SHEET = Case("A7 block on a membrane", SWEEPS, sheet)
VIBRATING = Case("Free block, let go squeezed", DRIFT, vibrating)
PULLED = Case("Springs pulled to five lengths", FLATTENED, pulled)
CROWD = Case("27 spheres that almost touch", TIME, crowd)
