"""What contact costs when little of it happens: the same 64 spheres in ever more contact.

    python tools/economy.py [--quick] [--repeats N] [--device NAME] [--out FILE]

The spheres are far apart; or so many pairs of them touch, the others far apart; or each rests on a
floor by itself; or all have collapsed into a pile on it. The floor is a plane or a mesh. Columns:

    case, friction   what touches, and Coulomb's coefficient
    vertices, contacts
    launches         kernels, fills, copies, scans and Bvh refits of a step
    step, elastic    a captured step [ms], and one without contact: damping, predict, drift
    KiB              of the Warp arrays of model, state and work
    stages           of the step [ms], by the modules of ``warp_contact/step``

Times are measured as in ``tools/bench.py``; all rows take the same number of steps in a frame.
Below the table, for each friction: ``nothing near / contact off`` is step over elastic while all
are apart; what contact adds is step - elastic. ``slope over pairs`` is the exponent p of what it
adds beyond the row apart, ~ pairs^p: 1 where each pair costs the same and none costs nothing.
``ms for any pair`` and ``ms per pair`` are the straight line through it; ``mesh / plane`` is the
ratio of what contact adds on both floors.

Last, frames of 32 blocks in 16 columns [ms]: while they settle, at rest, and asleep, with how far
sleep let them come from where they else are.
"""

import sys

import numpy as np
from clock.figures import frame_times, log_slope, step_figures
from clock.scenes import blocks, rows
from clock.window import Timing, measure
from measure import report
from measure.figure import Figure
from measure.run import command_line, count

from warp_contact import Simulation

FRICTIONS = 0.3, 0.0
SUBSTEPS = 20
SETTLING, REST, LONG, SAMPLE = 20, 40, 900, 20  # frames of the blocks
COLUMNS = {"case": 15, "friction": 8, "vertices": 8, "contacts": 8, "launches": 8}
TABLE = report.Table(**COLUMNS, step=6, elastic=7, KiB=5, stages=0)


def main() -> int:
    """Measure line by line, then print what follows from them."""
    parser = command_line(__doc__)
    parser.add_argument("--quick", action="store_true", help="one friction, floors not settled")
    parser.add_argument("--repeats", type=count, help="of a window; 5, or 3 with --quick")
    parser.add_argument("--device", help="cpu, cuda:0, ...")
    parser.add_argument("--out", metavar="FILE", help="write all figures there as JSON")
    args = parser.parse_args()
    print(TABLE.head())
    found: dict[str, float] = {}
    after: dict[str, float] = {}
    for friction in FRICTIONS[: 1 if args.quick else None]:
        table = rows(args.quick)
        timings = {}
        for name, case in table.items():
            sim = Simulation(case.build(friction), substeps=SUBSTEPS, device=args.device)
            for _ in sim.frames(case.frames):
                pass
            timings[name] = measure(sim, args.repeats or (3 if args.quick else 5))
            print(line(name, friction, sim.model.n_vert, timings[name]), flush=True)
            new = step_figures(timings[name], sim.model)
            found |= {f"{name}.{friction:g}.{key}": value for key, value in new.items()}
        pairs = {name: case.pairs for name, case in table.items() if case.pairs}
        new = summary(timings, pairs)
        after |= {f"friction {friction:g}: {name}": value for name, value in new.items()}
    after |= {f"blocks: {name}": value for name, value in sleep_figures(args.device).items()}
    print("", *(f"{name} {value:.3g}" for name, value in after.items()), sep="\n")
    if args.out:
        figures = [Figure("", *figure) for figure in (found | after).items()]
        report.write(args.out, figures, args.device)
    return 0


def line(name: str, friction: float, vertices: int, timing: Timing) -> str:
    """One line of the table."""
    stages = ", ".join(f"{stage} {cost.ms:.3f}" for stage, cost in timing.stages.items())
    cells = f"{friction:g}", f"{vertices}", f"{timing.contacts:.1f}", f"{timing.whole.launches:.1f}"
    times = f"{timing.step_ms:.3f}", f"{timing.elastic_ms:.3f}"
    return TABLE.line(name, *cells, *times, f"{timing.bytes / 1024:.0f}", stages)


def summary(timings: dict[str, Timing], pairs: dict[str, int]) -> dict[str, float]:
    """What the lines of one friction say together."""
    added = {name: timing.step_ms - timing.elastic_ms for name, timing in timings.items()}
    beyond = {n: added[name] - added["apart"] for name, n in pairs.items()}
    dearer = {n: ms for n, ms in beyond.items() if ms > 0.0}
    each, fixed = np.polyfit(list(beyond), list(beyond.values()), 1)
    apart = timings["apart"]
    return {
        "nothing near / contact off": apart.step_ms / apart.elastic_ms,
        "slope over pairs": log_slope(list(dearer), list(dearer.values())),
        "ms for any pair": float(fixed),
        "ms per pair": float(each),
        "mesh / plane, apart": added["on a mesh"] / added["on a plane"],
        "mesh / plane, pile": added["pile on a mesh"] / added["pile on a plane"],
    }


def sleep_figures(device: str | None) -> dict[str, float]:
    """What a frame of blocks costs settling, at rest and asleep, and what sleep changes."""
    awake, asleep = (Simulation(blocks(), sleeping=s, device=device) for s in (False, True))
    settling = frame_ms(awake, SETTLING)
    while asleep.frame < REST or (asleep.state.v.numpy().any() and asleep.frame < LONG):
        asleep.step_frame()
    while awake.frame < asleep.frame:
        awake.step_frame()
    resting, sleeping = frame_ms(awake, SAMPLE), frame_ms(asleep, SAMPLE)
    apart = np.abs(awake.positions() - asleep.positions()).max() / awake.model.body_edge.numpy()[0]
    return {
        "settling ms": settling,
        "at rest ms": resting,
        "asleep ms": sleeping,
        "asleep / settling": sleeping / settling,
        "frames until all sleep": float(asleep.frame - SAMPLE),
        "sleep moved, of an edge": float(apart),
    }


def frame_ms(sim: Simulation, frames: int) -> float:
    """Median time of the next frames [ms]."""
    return 1e3 * float(np.median(frame_times(sim, frames)))


if __name__ == "__main__":
    sys.exit(main())
