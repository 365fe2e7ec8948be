"""The figures of one case, and of a start, by name; what they are: ``tools/bench.py``."""

import os
import resource
import subprocess
import sys
import tempfile
from statistics import median
from time import perf_counter
from unittest import mock

import numpy as np
import warp as wp

import warp_contact as wc
from clock.scenes import Case
from clock.window import Timing, measure

START = """
from time import perf_counter
begin = perf_counter()
import warp_contact as wc
imported = perf_counter()
from warp_contact.scenes import squeezed_sphere
wc.Simulation(squeezed_sphere.build(), device={!r}).step_frame()
print(imported - begin, perf_counter() - imported)
"""
STARTS = 3  # with kernels that are compiled already
SHOWN_FRAMES = 3  # of which the median gives the frames per second
BOUND = 90.0, 150.0, 1000.0  # ns that a tet, a surface vertex, a contact with its sweeps may take


def figures(case: Case, frames: int | None, repeats: int, device: str | None) -> dict[str, float]:
    """Run a case until there are contacts, then time it."""
    wp.config.log_level = wp.LOG_WARNING
    sim = wc.Simulation(case.build(), device=device)
    frame_times(sim, case.frames if frames is None else frames)
    timing, model, spectrum = measure(sim, repeats), sim.model, sim._stepper.spectrum
    choice, rates = [], spectrum.rates

    def timed(x: wp.array) -> tuple[float, float]:
        start = perf_counter()
        found = rates(x)
        choice.append(perf_counter() - start)
        return found

    with mock.patch.object(spectrum, "rates", timed):
        times = frame_times(sim, SHOWN_FRAMES)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "vertices": model.n_vert,
        "surface_vertices": model.n_surf,
        "tets": model.n_tet,
        "bodies": model.n_body,
        "substeps": sim.substeps,
        "window_steps": timing.steps,
        **step_figures(timing, model),
        "frames_per_second": 1.0 / median(times),
        "frame.choice_of_step_share": sum(choice) / sum(times),
        "array_bytes_per_vertex": timing.bytes / model.n_vert,
        "peak_rss_bytes": peak if sys.platform == "darwin" else 1024 * peak,
    }


def step_figures(timing: Timing, model) -> dict[str, float]:
    """The whole step, then each stage, then each operation."""
    whole, step = timing.whole, timing.step_ms
    sizes = {"tet": model.n_tet, "surface_vertex": model.n_surf, "contact": timing.contacts}
    bound = sum(ns * n for ns, n in zip(BOUND, sizes.values(), strict=True))
    overhead = 1e3 * (step - whole.ms)
    found = {
        "contacts": timing.contacts,
        "array_bytes": timing.bytes,
        "step.launches": whole.launches,
        "step.ms": step,
        "step.ns_per_vertex": 1e6 * step / model.n_vert,
        "step.elastic_ms": timing.elastic_ms,
        "step.operations_ms": whole.ms,
        "step.overhead_us_per_launch": overhead / whole.launches,
        "step.overhead_us": overhead,
        "step.of_bound": 1e6 * step / bound,
        "step.bytes": whole.bytes,
    }
    for stage, cost in timing.stages.items():
        found |= {f"{stage}.{name}": value for name, value in cost._asdict().items()}
        found[f"{stage}.share"] = cost.ms / (whole.ms or 1.0)  # a clock may be too coarse
        each = {f"{stage}.ns_per_{thing}": 1e6 * cost.ms / n for thing, n in sizes.items() if n}
        found |= each
    for (stage, name), cost in timing.kernels.items():
        found[f"{stage}.{name}.launches"] = cost.launches
        found[f"{stage}.{name}.ms"] = cost.ms
    return found


def frame_times(sim: wc.Simulation, frames: int) -> list[float]:
    """Wall time of each of the next frames [s], that on the host included."""
    times = []
    for _ in range(frames):
        start = perf_counter()
        sim.step_frame()
        wp.synchronize_device(sim.device)
        times.append(perf_counter() - start)
    return times


def start_times(device: str | None) -> dict[str, float]:
    """Seconds of the import, and from there to the end of the first frame.

    ``cold_frame_s`` compiles all kernels, ``warm_frame_s`` finds them compiled.
    """
    command = [sys.executable, "-c", START.format(device)]
    with tempfile.TemporaryDirectory() as cache:
        run = {"env": os.environ | {"WARP_CACHE_PATH": cache}, "stdout": subprocess.PIPE}
        starts = []
        for _ in range(1 + STARTS):
            done = subprocess.run(command, text=True, check=True, **run)
            starts.append([float(seconds) for seconds in done.stdout.splitlines()[-1].split()])
    imports, frames = zip(*starts[1:], strict=True)
    first = {"import_s": median(imports), "warm_frame_s": median(frames)}
    return first | {"cold_frame_s": starts[0][1]}


def log_slope(x, y) -> float:
    """Exponent p of the fit y ~ x^p."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])
