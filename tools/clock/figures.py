"""The figures of one case, by name."""

from statistics import median
from time import perf_counter
from unittest import mock

import numpy as np
import warp as wp

import warp_contact as wc
from clock.cases import Case
from clock.memory import peak
from clock.window import Timing, measure

SHOWN_FRAMES = 3  # of which the median gives the frames per second


def figures(case: Case, frames: int | None, repeats: int, device: str | None) -> dict[str, float]:
    """Run a case until there are contacts, then time it."""
    wp.config.log_level = wp.LOG_WARNING
    sim = wc.Simulation(case.build(), device=device)
    for _ in sim.frames(case.frames if frames is None else frames):
        pass
    timing = measure(sim, repeats)
    model = sim.model
    seconds, choice = frame_time(sim)
    return {
        "vertices": model.n_vert,
        "surface_vertices": model.n_surf,
        "tets": model.n_tet,
        "bodies": model.n_body,
        "contacts": timing.contacts,
        "substeps": sim.substeps,
        "window_steps": timing.steps,
        **step_figures(timing, model),
        "frames_per_second": 1.0 / seconds,
        "frame.choice_of_step_share": choice,
        "array_bytes": timing.bytes,
        "array_bytes_per_vertex": timing.bytes / model.n_vert,
        "peak_rss_bytes": peak(),
    }


def step_figures(timing: Timing, model) -> dict[str, float]:
    """The whole step, then each stage."""
    found = {
        "step.launches": sum(timing.launches.values()),
        "step.ms": timing.step_ms,
        "step.ns_per_vertex": 1e6 * timing.step_ms / model.n_vert,
        "step.elastic_ms": timing.elastic_ms,
        "step.operations_ms": sum(timing.ms.values()),
        "step.overhead_us_per_launch": timing.overhead_us,
        "step.overhead_us": timing.overhead_us * sum(timing.launches.values()),
        "step.of_bound": 1e6 * timing.step_ms / bound(model, timing.contacts),
        "step.bytes": sum(timing.given.values()),
    }
    for stage, ms in timing.ms.items():
        found[f"{stage}.launches"] = timing.launches[stage]
        found[f"{stage}.ms"] = ms
        found[f"{stage}.bytes"] = timing.given[stage]
        found[f"{stage}.share"] = timing.shares[stage]
        found[f"{stage}.ns_per_tet"] = 1e6 * ms / model.n_tet
        found[f"{stage}.ns_per_surface_vertex"] = 1e6 * ms / model.n_surf
        if timing.contacts:
            found[f"{stage}.ns_per_contact"] = 1e6 * ms / timing.contacts
    for (stage, name), (launches, ms) in timing.kernels.items():
        found[f"{stage}.{name}.launches"] = launches
        found[f"{stage}.{name}.ms"] = ms
    return found


def bound(model, contacts: float) -> float:
    """What a step may take [ns], by the size of the scene; the contacts with all their sweeps."""
    return 90.0 * model.n_tet + 150.0 * model.n_surf + 1000.0 * contacts


def frame_time(sim: wc.Simulation) -> tuple[float, float]:
    """Time of a frame [s], that on the host included, and the part that chooses the step."""
    times, choice, rates = [], [0.0], sim._stepper.spectrum.rates

    def timed(x: wp.array) -> tuple[float, float]:
        start = perf_counter()
        found = rates(x)
        choice[0] += perf_counter() - start
        return found

    with mock.patch.object(sim._stepper.spectrum, "rates", timed):
        for _ in range(SHOWN_FRAMES):
            start = perf_counter()
            sim.step_frame()
            wp.synchronize_device(sim.device)
            times.append(perf_counter() - start)
    return median(times), choice[0] / sum(times)


def log_slope(x, y) -> float:
    """Exponent p of the fit y ~ x^p."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])
