"""Where time and memory go: one figure a line, as ``case.figure value``.

    python tools/bench.py [case ...] [--large] [--frames N] [--fraction PART]
        [--repeats N] [--integrator KIND] [--device NAME]

Each case runs in a process of its own until there are contacts, then the same few steps again and
again (a window, begun from the same state each time): as one captured graph, and uncaptured with a
timer around every operation (``clock/timer.py``). Times are medians over the repeats, averaged
over the steps of the window; all are those of one step. On the CPU they are times of the thread,
so that other processes on the machine hardly count; those of frames and starts are wall times.

    step.launches              kernels, fills, copies, scans and Bvh refits
    step.ms                    the captured step, as simulations run it
    step.ns_per_vertex         the same for each vertex
    step.elastic_ms            a captured step without contact: damping, predict, drift
    step.operations_ms         sum of all operations, each without what its call costs
    step.overhead_us_per_launch  what the captured step takes beyond that, for each operation
    step.overhead_us           the same for the step
    step.us_per_contact        what contact adds to the step, for each
    step.of_bound              step.ms over 90 ns a tet, 150 ns a surface vertex, 1 us a contact
    STAGE.launches, .ms        of a stage: what a module of ``warp_contact/step`` launches itself;
                               ``step_alone`` is ``step.py``
    STAGE.share                of the sum of all operations
    frames_per_second          of whole frames of 1/60 s, with the choice of the step
    frame.choice_of_step_share    of the time of these frames
    frame.launches             step.launches times the steps of a frame
    contacts                   at the end of a step
    window_steps               steps of the window
    array_bytes_per_vertex     of the Warp arrays of model, state and work; without the Bvhs
    peak_rss_bytes             largest resident size of the process

``pile.slope`` and ``worlds.slope`` are the exponents p of step.ms ~ vertices^p. ``pairs_N`` are 64
spheres of which N pairs touch; what contact adds to a step beyond that of ``pairs_0`` is about
``pairs.any_ms + N pairs.each_ms``. ``sleep`` are frames of 32 blocks in 16 columns: while they
settle, at rest, and asleep, with how far sleep let them come from where they else are [edges].
``writer`` are frames of scenes and what a ``UsdWriter`` takes for each, in the folder of the call,
with one thread of USD as in ``warp-contact run``; ``PXR_WORK_THREAD_LIMIT=0`` lets it have all.
``start.import_s`` is the import of the package; ``start.warm_frame_s`` and ``start.cold_frame_s``
are the first frame after it, the scene included, with and without kernels compiled before.
"""

import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
from clock.figures import figures, sleep_figures, start_times, writer_figures
from clock.scenes import FRACTION, PAIRS, Case, cases
from measure import machine
from measure.run import command_line, count, one_of

from warp_contact.frame.integrator import KINDS
from warp_contact.usd.threads import one_thread

# cases with figures of their own
OTHERS = {"sleep": sleep_figures, "writer": writer_figures, "start": start_times}


def main() -> int:
    """Run the cases and print their figures as they come."""
    parser = command_line(__doc__)
    named = one_of([*cases(True, FRACTION), *OTHERS])
    parser.add_argument("cases", nargs="*", type=named, metavar="case", help="or all")
    parser.add_argument("--large", action="store_true", help="a pile of 1e6 vertices, 4096 worlds")
    parser.add_argument("--frames", type=count, help="to run before, in place of each case's own")
    parser.add_argument("--fraction", type=float, default=FRACTION, help="of the bowl's fruits")
    parser.add_argument("--repeats", type=count, default=7, help="of a window")
    parser.add_argument("--integrator", default="explicit", choices=KINDS)
    parser.add_argument("--device", help="cpu, cuda:0, ...")
    args = parser.parse_args()
    known = cases(True, args.fraction)
    chosen = args.cases or [*cases(args.large, args.fraction), *OTHERS]
    timed = {name: case for name, case in known.items() if name in chosen}
    print(machine.line(args.device), "", sep="\n", flush=True)
    found: dict[str, float] = {}
    given = {"frames": args.frames, "repeats": args.repeats, "integrator": args.integrator}
    run = partial(figures, device=args.device, **given)
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, spawn, max_tasks_per_child=1) as pool:
        for name, new in zip(timed, pool.map(run, timed.values()), strict=True):
            found |= show(f"{name}.", new)
    show("", summary(found, timed))
    for name in (n for n in OTHERS if n in chosen):
        show(f"{name}.", OTHERS[name](args.device))
    return 0


def show(case: str, new: dict[str, float]) -> dict[str, float]:
    """Print the figures of a case; they, by their full names."""
    found = {case + name: value for name, value in new.items()}
    for name, value in found.items():
        print(f"{name} {value:.5g}", flush=True)
    return found


def summary(found: dict[str, float], timed: dict[str, Case]) -> dict[str, float]:
    """The exponents of the time of a step over the vertices, and what pairs that touch cost."""
    new = {}
    for series in sorted({case.series for case in timed.values()} - {""}):
        names = [name for name, case in timed.items() if case.series == series]
        if len(names) > 1:
            of = (np.log([found[f"{n}.{f}"] for n in names]) for f in ("vertices", "step.ms"))
            new[f"{series}.slope"] = np.polyfit(*of, 1)[0]
    pairs = [f"pairs_{n}.step" for n in PAIRS]
    if all(f"{name}.ms" in found for name in pairs):
        apart, *added = (found[f"{name}.ms"] - found[f"{name}.elastic_ms"] for name in pairs)
        each, fixed = np.polyfit(PAIRS[1:], np.array(added) - apart, 1)
        new |= {"pairs.any_ms": fixed, "pairs.each_ms": each}
    return new


if __name__ == "__main__":
    one_thread()  # as ``warp-contact run``
    sys.exit(main())
