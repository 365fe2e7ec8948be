"""What contact costs when little of it happens: the same 64 spheres in ever more contact.

    python tools/economy.py [--repeats N] [--device NAME]

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
from clock.figures import frame_times, log_slope
from clock.scenes import ROWS, blocks
from clock.window import Timing, measure
from measure.report import Table
from measure.run import command_line, count

from warp_contact import Simulation

FRICTIONS = 0.3, 0.0
SUBSTEPS = 20
SETTLING, REST, LONG, SAMPLE = 20, 40, 900, 20  # frames of the blocks
COLUMNS = {"case": 15, "friction": 8, "vertices": 8, "contacts": 8, "launches": 8}
TABLE = Table(**COLUMNS, step=6, elastic=7, KiB=5, stages=0)


def main() -> int:
    """Measure line by line, then print what follows from them."""
    parser = command_line(__doc__)
    parser.add_argument("--repeats", type=count, default=5, help="of a window")
    parser.add_argument("--device", help="cpu, cuda:0, ...")
    args = parser.parse_args()
    print(TABLE.head())
    after: dict[str, float] = {}
    for friction in FRICTIONS:
        timings = {}
        for name, case in ROWS.items():
            sim = Simulation(case.build(friction), substeps=SUBSTEPS, device=args.device)
            frame_times(sim, case.frames)
            timings[name] = t = measure(sim, args.repeats)
            cells = f"{friction:g}", str(sim.model.n_vert), f"{t.contacts:.1f}"
            times = f"{t.whole.launches:.1f}", f"{t.step_ms:.3f}", f"{t.elastic_ms:.3f}"
            stages = ", ".join(f"{stage} {cost.ms:.3f}" for stage, cost in t.stages.items())
            row = TABLE.line(name, *cells, *times, f"{t.bytes / 1024:.0f}", stages)
            print(row, flush=True)
        for name, value in summary(timings).items():
            after[f"friction {friction:g}: {name}"] = value
    after |= {f"blocks: {name}": value for name, value in sleep_figures(args.device).items()}
    print("", *(f"{name} {value:.3g}" for name, value in after.items()), sep="\n")
    return 0


def summary(timings: dict[str, Timing]) -> dict[str, float]:
    """What the lines of one friction say together."""
    added = {name: timing.step_ms - timing.elastic_ms for name, timing in timings.items()}
    beyond = {case.pairs: added[name] - added["apart"] for name, case in ROWS.items() if case.pairs}
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
    settling = frame_times(awake, SETTLING)
    while asleep.frame < REST or (asleep.state.v.numpy().any() and asleep.frame < LONG):
        asleep.step_frame()
    while awake.frame < asleep.frame:
        awake.step_frame()
    times = settling, frame_times(awake, SAMPLE), frame_times(asleep, SAMPLE)
    settling, resting, sleeping = (1e3 * float(np.median(t)) for t in times)
    apart = np.abs(awake.positions() - asleep.positions()).max() / awake.model.body_edge.numpy()[0]
    return {
        "settling ms": settling,
        "at rest ms": resting,
        "asleep ms": sleeping,
        "asleep / settling": sleeping / settling,
        "frames until all sleep": float(asleep.frame - SAMPLE),
        "sleep moved, of an edge": float(apart),
    }


if __name__ == "__main__":
    sys.exit(main())
