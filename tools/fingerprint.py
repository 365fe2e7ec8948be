"""One hash for each of some short runs that together reach every kernel of a simulation.

    python tools/fingerprint.py [run ...] [--against FILE] [--reach] [--device NAME]

A hash is of positions, velocities, contact forces and contact fields after every frame, to the last
bit: a change that is meant to change nothing leaves all of them as they were, and one that is meant
to change something says which. Bits depend on the processor and on the version of Warp, so compare
on one machine only: ``--against`` compares with a file of what was printed before, and the exit
status is 1 when any differs. ``--reach`` prints which kernels no run has launched.

On the CPU kernels are compiled so that each product and each sum is rounded by itself. As
simulations run them the compiler contracts some of them, which depends on how the arrays lie in
memory.
"""

import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from hashlib import sha256
from pathlib import Path
from unittest import mock

import numpy as np
import warp as wp
from measure.run import command_line, one_of
from trials.setting import NONE, UP, body, scene

import warp_contact as wc
from warp_contact.scenes import load

JELLY = wc.NeoHookean(5e4, 0.3, 1000.0, 2e-3)
FIRM = wc.NeoHookean(5e5, 0.4, 1000.0, 1e-3)
Run = Iterator[wc.Simulation]  # a simulation after each of its frames


def frames(sim: wc.Simulation, n: int) -> Run:
    """The next frames of a simulation."""
    for _ in sim.frames(n):
        yield sim


def paper(n: int, name: str, **arguments) -> Run:
    """A scene of the paper."""
    return frames(wc.Simulation(load(name).build(**arguments)), n)


def run(
    n: int, *bodies: dict, response=None, fps=60, substeps=None, integrator="explicit", **around
) -> Run:
    """Bodies among what is ``around``: gravity, coefficients and planes."""
    given = response, fps, substeps
    return frames(wc.Simulation(scene(*bodies, **around), *given, integrator=integrator), n)


def slide() -> Run:
    """A block slides down a slope, made of a plane, into a wall."""
    slope, turn = np.array([np.sin(0.5), 0.0, np.cos(0.5)]), (0.0, np.sin(0.25), 0.0, np.cos(0.25))
    block = body(wc.box(0.1, 2), JELLY, 0.0502 * slope, turn, (0.5, 0.1, 0.0))
    valley = scene(block, planes=[slope])
    valley.add_plane((-1.0, 0.0, 0.0), -0.15)
    return frames(wc.Simulation(valley), 30)


def materials() -> Run:
    """Every material, damped and not, on each other."""
    kinds = (
        wc.Corotated(1e5, 0.3, 1000.0, 1e-3),
        wc.SpringNetwork(0.5, 0.5, 2.0, 1000.0, 1e-3),
        wc.NeoHookean(5e4, 0.3, 1000.0),
        wc.NeoHookean(5e4, 0.3, 1000.0, 2e-2),
    )
    stack = []
    for k, kind in enumerate(kinds):
        place = 0.01 * (-1) ** k, 0.0, 0.041 + 0.082 * k
        stack.append(body(wc.box(0.08, 2 + k % 2), kind, place))
    return run(12, *stack, planes=[UP], friction=0.5)


def worlds() -> Run:
    """Copies that never meet, each a little faster than the one before."""
    bodies = []
    for world in range(4):
        bodies.append(body(wc.sphere(0.05, 95), JELLY, 0.051, world=world))
        place, v = (0.01, 0.0, 0.14), -0.5 - 0.2 * world
        bodies.append(body(wc.box(0.06, 2), FIRM, place, v=v, world=world))
    return run(12, *bodies, planes=[UP])


def sleeping() -> Run:
    """Blocks fall asleep, and one of them is woken."""
    places = (0.0, 0.0, 0.0502), (0.01, 0.0, 0.1506), (1.0, 0.0, 0.0502)
    strong = wc.NeoHookean(3e4, 0.3, 1000.0, 1e-2)
    blocks = scene(*(body(wc.box(0.1, 2), strong, at) for at in places), planes=[UP])
    sim = wc.Simulation(blocks, sleeping=True)
    yield from frames(sim, 150)
    sim.set_velocity(2, (-2.0, 0.0, 1.0))
    yield from frames(sim, 40)


def driven() -> Run:
    """A finger that is moved by hand presses a ball against a fixed block, then lets it go."""
    block, tip = wc.box((0.2, 0.2, 0.05), (4, 4, 1)), wc.box(0.06, 2)
    top = tip.vertices[:, 2] > 0.029
    ball, finger = body(wc.sphere(0.04, 95), JELLY, 0.066), body(tip, FIRM, 0.14, fixed=top)
    sim = wc.Simulation(scene(body(block, FIRM, fixed=True), ball, finger, friction=0.6))
    sim.set_velocity(2, (0.0, 0.0, -0.2), top)
    yield from frames(sim, 12)
    sim.set_velocity(2, (0.1, 0.0, 0.3), top)
    yield from frames(sim, 6)
    sim.set_positions(1, sim.positions(1) + [0.0, 0.0, 0.005])
    yield from frames(sim, 6)


def resumed() -> Run:
    """A run that goes on from its checkpoint in another simulation."""
    first, second = (wc.Simulation(scene(*BLOCKS, planes=[UP])) for _ in range(2))
    yield from frames(first, 8)
    with tempfile.TemporaryDirectory() as folder:
        first.save(Path(folder) / "half.npz")
        second.load(Path(folder) / "half.npz")
    yield from frames(second, 8)


def pile() -> Run:
    """Many small bodies: lists outgrow their buffers."""
    rng, balls = np.random.default_rng(0), []
    for k in range(48):
        place = 0.062 * np.array([k % 4, k // 4 % 4, k // 16]) + rng.uniform(0.0, 0.003, 3)
        balls.append(body(wc.sphere(0.03, 41), JELLY, place + [0.0, 0.0, 0.031]))
    return run(14, *balls, planes=[UP])


BLOCKS = (  # one falls on the other, a little aside
    body(wc.box(0.1, 3), JELLY, 0.052),
    body(wc.box(0.08, 2), JELLY, (0.01, 0.02, 0.144), v=(0.1, 0.0, -0.5)),
)
INSIDE = body(wc.box(0.1, 3), JELLY), body(wc.box(0.1, 4), FIRM, (0.02, 0.01, 0.06))
TILT = np.array([0.3, 0.4, 0.5, 0.7]) / np.sqrt(0.99)
CORNERS = (  # and edges strike and slide
    body(wc.box(0.1, 4), JELLY, v=0.5),
    body(wc.box(0.1, 5), FIRM, (0.02, 0.013, 0.13), TILT, (0.1, 0.0, -0.5)),
)
S, C = np.sin(np.pi / 8), np.cos(np.pi / 8)
BAR = wc.box((0.4, 0.04, 0.04), (8, 1, 1))
CROSSED = (  # bars that lie on an edge each touch along their edges alone
    body(BAR, FIRM, turn=(S, 0.0, 0.0, C), fixed=np.abs(BAR.vertices[:, 0]) > 0.19),
    body(BAR, JELLY, (0.03, 0.0, 0.058), np.sqrt(0.5) * np.array([S, S, C, C])),
)
HEAVY = wc.NeoHookean(5e5, 0.3, 40000.0, 1e-3)
CRUSHED = (  # tets are pressed flat, and frames repeated
    body(wc.box(0.05, 2), JELLY, 0.026),
    body(wc.box(0.1, 2), HEAVY, 0.105, v=-2.0),
)

RIGID = (  # under a soft one, and on it
    body(wc.box(0.1, 2), wc.Rigid(1000.0), 0.0501),
    body(wc.box(0.1, 2), JELLY, (0.01, 0.0, 0.1503)),
    body(wc.box(0.05, 2), wc.Rigid(2000.0), (0.0, 0.02, 0.27), TILT),
)
MIXED = (  # a body too large for an inverse, a rigid one and a soft one
    body(wc.box(0.2, 9), JELLY, 0.1001),
    body(wc.box(0.06, 2), wc.Rigid(3000.0), (0.03, 0.0, 0.232), v=-0.5),
    body(wc.box(0.06, 2), FIRM, (-0.05, 0.0, 0.232), v=-0.5),
)

falling = partial(run, 15, *BLOCKS, planes=[UP], fps=120)
RUNS: dict[str, Callable[[], Run]] = {
    "two_bodies": partial(paper, 6, "two_bodies"),
    "sampling": partial(paper, 5, "sampling"),
    "squeezed_sphere": partial(paper, 40, "squeezed_sphere"),
    "cubes_on_membrane": partial(paper, 20, "cubes_on_membrane"),
    "membrane_stack": partial(paper, 6, "membrane_stack"),
    "bowl": partial(paper, 20, "bowl", fraction=0.1),
    "inside": partial(run, 6, *INSIDE, gravity=NONE),
    "inside_literal": partial(run, 6, *INSIDE, response=wc.ContactSurface("literal"), gravity=NONE),
    "tilted": partial(run, 25, *CORNERS, gravity=NONE, friction=0.4, fps=240),
    "crossed": partial(run, 20, *CROSSED),
    "friction": slide,
    "materials": materials,
    "literal": partial(falling, response=wc.ContactSurface("literal")),
    "penalty": partial(falling, response=wc.Penalty(2000.0, 0.5)),
    "virtual": partial(falling, response=wc.VirtualSurface(4000.0, 0.5)),
    "predicted": partial(falling, response=wc.PredictedForce()),
    "worlds": worlds,
    "sleeping": sleeping,
    "driven": driven,
    "resumed": resumed,
    "crushed": partial(run, 12, *CRUSHED, planes=[UP]),
    "chosen": partial(run, 10, *BLOCKS, planes=[UP], friction=0.4, substeps=40),
    "pile": pile,
    "implicit": partial(run, 20, *CORNERS, gravity=NONE, friction=0.4, integrator="implicit"),
    "implicit_inside": partial(run, 10, *INSIDE, gravity=NONE, integrator="implicit"),
    "implicit_crushed": partial(run, 8, *CRUSHED, planes=[UP], integrator="implicit"),
    "implicit_crossed": partial(run, 20, *CROSSED, integrator="implicit"),
    "rigid": partial(run, 30, *RIGID, planes=[UP], friction=0.5),
    "bouncing": partial(run, 20, *RIGID, planes=[UP], friction=0.5, restitution=0.7),
    "mixed": partial(run, 6, *MIXED, planes=[UP], friction=0.5, integrator="implicit"),
    "sheets": partial(paper, 10, "membrane_stack", count=3, gap=0.002),  # vertex on vertex
}


def fingerprint(run: Run) -> str:
    """The hash of the state after each frame, and of what contact did in it."""
    found = sha256()
    for sim in run:
        fields = sim.contact_fields()
        of_contact = (fields[name] for name in ("pressure", "penetration", "partner"))
        for values in (sim.positions(), sim.velocities(), *of_contact):
            found.update(np.ascontiguousarray(values).tobytes())
        measured = sim.measure()
        found.update(repr(sorted(measured.forces.items())).encode())
        found.update(repr((sim.substeps, measured.n_contacts, measured.overlap)).encode())
    return found.hexdigest()[:16]


def kernels() -> set[wp.Kernel]:
    """All that there are, but for those that draw pictures."""
    modules = [m for name, m in sys.modules.items() if name.startswith("warp_contact.kernels.")]
    return {k for module in modules for k in vars(module).values() if isinstance(k, wp.Kernel)}


def round_each_operation() -> None:
    """Compile all kernels without contraction of products and sums."""
    for module in {kernel.module for kernel in kernels()}:
        flags = module.options["cpu_compiler_flags"]
        module.options["cpu_compiler_flags"] = flags.replace("contract=fast", "contract=off")
        module.mark_modified()


def main() -> int:
    """Print the hashes; compare them where asked to."""
    parser = command_line(__doc__)
    parser.add_argument("runs", nargs="*", type=one_of(RUNS), metavar="run", help="or all")
    parser.add_argument("--against", type=Path, metavar="FILE", help="compare with those of a file")
    parser.add_argument("--reach", action="store_true", help="name kernels that no run launched")
    parser.add_argument("--device", help="cpu, cuda:0, ...")
    args = parser.parse_args()
    wp.set_device(args.device)
    round_each_operation()
    lines = args.against.read_text(encoding="utf-8").splitlines() if args.against else []
    before = dict(line.split() for line in lines)
    changed, launched, launch = 0, set(), wp.launch

    def noted(kernel: wp.Kernel, *given, **named):
        launched.add(kernel)
        return launch(kernel, *given, **named)

    chosen = args.runs or list(RUNS)
    with mock.patch.object(wp, "launch", noted):
        for name in chosen:
            value = fingerprint(RUNS[name]())
            was = before.get(name, value)
            changed += was != value
            print(f"{name} {value}" + (f" was {was}" if was != value else ""), flush=True)
    if args.reach:
        missed = sorted(f"{k.module.name}.{k.key}" for k in kernels() - launched)
        print("not launched:", ", ".join(missed) or "none")
    if args.against:
        print(f"{changed} of {len(chosen)} changed")
    return int(changed > 0)


if __name__ == "__main__":
    sys.exit(main())
