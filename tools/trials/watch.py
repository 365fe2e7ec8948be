"""Runs a setting and looks at it after each frame, from positions alone where that is possible.

A body is lost when its centre is behind a plane, or when the centres of a watched pair have
swapped along the pair's direction while one is still in front of the other: one has gone through
the other rather than past it.

The rise of the energy is measured against that of the start, kinetic and elastic, plus the weights
times the smallest extent of a body, plus ``FLOOR`` times E V, below which all is rounding. Bodies
that start in each other hold an energy that no one knows until they are apart. What they must not
do is pop: there, the kinetic energy of their centres of mass may not pass the elastic energy, the
largest that was seen or what the overlap would hold if it were closed at once, and by how much it
does, over that, stands for the rise.
"""

import signal
from collections.abc import Callable
from contextlib import contextmanager
from traceback import walk_stack

import numpy as np
from verification.setup import masses, mean_edge

import warp_contact as wc
from trials.outcome import SUNK, Record
from trials.setting import UP, Setting

FACTORS = 0.01, 0.1, 1.0, 10.0, 100.0  # of E l, the stiffness of the softest body's tets
METHODS = "surface", "literal", *(f"penalty {f:g}" for f in FACTORS), "implicit"
LIMIT = 600.0  # seconds that a run may take
FLOOR = 1e-8
RUNAWAY = 100.0  # gain of energy after which a run is not followed further
ACROSS = 0.5  # of the wider body's middle extent: "in front of" is nearer to the line than this
AGAIN = 0.01  # s after which an alarm that came at a bad moment rings again


def attempt(
    build: Callable[[], Setting],
    method: str = METHODS[0],
    most_steps: int = 10**9,
    limit: float = LIMIT,
) -> Record:
    """Build a setting and run it to its end or its first failure for good.

    What cannot be built is refused. A run is not followed further than ``most_steps``, and may take
    ``limit`` seconds.
    """
    r, sim = Record(), None
    try:
        setting = build()
        r.asked = setting.seconds
        answer = response(method, setting.scene)
        kind = "implicit" if method == "implicit" else "explicit"
        settings = setting.fps, setting.substeps
        sim = wc.Simulation(setting.scene, answer, *settings, integrator=kind)
        watch = Watch(sim, setting, r)
        with alarm(limit):
            for _ in range(round(setting.seconds * setting.fps)):
                if setting.drive:
                    setting.drive(sim)
                sim.step_frame()
                watch.look()
                if not r.finite or r.lost or r.gained > RUNAWAY or r.steps >= most_steps:
                    break
    except (ValueError, wc.SimulationError) as error:
        if sim is None or sim.substeps == 0:
            r.refused = str(error)
        else:
            r.error, r.finite = str(error), "finite" not in str(error)
    except TimeoutError:
        r.error = f"frame {sim.frame + 1}: not done after {limit:g} s"
    return r


def response(method: str, scene: wc.Scene):
    """The response of a method; a penalty's stiffness is a factor of E l, l a mean edge [N/m]."""
    name, *factor = method.split()
    if not factor:
        return wc.ContactSurface("literal" if name == "literal" else "balanced")
    mobile = [b for b in scene.bodies if not b.fixed.all()]
    stiffness = min(b.material.youngs_modulus * mean_edge(b.mesh) for b in mobile)
    return wc.Penalty(float(factor[0]) * stiffness)


class Watch:
    """The record of a run as it grows."""

    def __init__(self, sim: wc.Simulation, setting: Setting, record: Record | None = None):
        """Remember the start."""
        self.sim, self.setting, self.record = sim, setting, record or Record()
        bodies = sim.scene.bodies
        extents = np.sort([np.ptp(b.mesh.vertices, axis=0) for b in bodies], axis=1)
        self.size, self._width = float(extents[:, 0].min()), extents[:, 1]
        pairs = setting.pairs
        self._pairs = [(k, k + 1) for k in range(len(bodies) - 1)] if pairs is None else pairs
        start = sim.measure()
        self._start, self.record.touched = start.energy, start.overlap > 0.0
        mobile = sim.model.mass.numpy() * (sim.model.inv_mass.numpy() > 0.0)
        weight = float(mobile.sum(dtype=float)) * float(np.linalg.norm(sim.scene.gravity))
        stored = sum(b.material.youngs_modulus * b.mesh.volume for b in bodies)
        self._scale = abs(start.kinetic) + start.elastic + weight * self.size + FLOOR * stored
        self._flight, self._elastic = 0.0, 0.0

    def look(self) -> Record:
        """Add the present state to the record."""
        r, sim, setting = self.record, self.sim, self.setting
        r.steps += sim.substeps
        r.time = sim.time
        r.finite = bool(np.isfinite(sim.positions()).all() and np.isfinite(sim.velocities()).all())
        if not r.finite:
            return r
        r.lost = r.lost or self._wrong_side()
        now = sim.measure()
        r.volume = now.volume_ratio
        r.lowest = min(r.lowest, r.volume)
        r.touched = r.touched or now.n_contacts > 0 or bool(now.forces)
        deepest = now.overlap / self.size
        if setting.recovers:
            r.overlap = deepest
            self._pop(now.elastic)
            return r
        r.overlap = max(r.overlap, deepest)
        r.tunnelled, r.through = now.tunnelled, now.tunnelled_pair
        if setting.drive is None:
            r.gained = max(r.gained, (now.energy - self._start) / self._scale)
        return r

    def _pop(self, elastic: float) -> None:
        """What the bodies have gained that started in each other."""
        r, closed = self.record, self.setting.held
        m, v = masses(self.sim), self.sim.velocities().astype(float)
        first = self.sim.model.body_vert.numpy()[:-1]
        p = np.add.reduceat(m[:, None] * v, first)  # momentum of each body
        flight = float((0.5 * np.einsum("bi,bi->b", p, p) / np.add.reduceat(m, first)).sum())
        self._flight, self._elastic = max(self._flight, flight), max(self._elastic, elastic)
        held = max(self._elastic, closed)
        r.gained = max(0.0, (self._flight - held) / (held + self._scale))
        if closed > 0.0:
            seen = self._flight / self._elastic if self._elastic > 0.0 else np.inf
            r.note = f"motion {self._flight / closed:.2f} of what the overlap holds closed, "
            r.note += f"{seen:.2f} of the elastic energy seen"

    def _wrong_side(self) -> str:
        """Who is on whose wrong side."""
        bodies = self.sim.scene.bodies
        centre = [self.sim.positions(b).astype(float).mean(axis=0) for b in bodies]
        for p, (n, h) in enumerate(self.sim.scene.planes):
            for body in bodies:
                if centre[body.index] @ n < h - SUNK * self.size:
                    return f"{body.label} is behind plane {p}"
        for a, b, *axis in self._pairs:
            up = np.array(axis[0] if axis else UP, dtype=float)
            apart = centre[b] - centre[a]
            along = float(apart @ up)
            aside = float(np.linalg.norm(apart - along * up))
            if along < 0.0 and aside < ACROSS * max(self._width[a], self._width[b]):
                return f"{bodies[b].label} went through {bodies[a].label}"
        return ""


@contextmanager
def alarm(seconds: float):
    """Raise TimeoutError in the body after so long: a frame may ask for any number of steps."""

    def ring(_, frame):
        if any(f.f_code.co_name == "__del__" for f, _ in walk_stack(frame)):  # would be lost there
            signal.setitimer(signal.ITIMER_REAL, AGAIN)
            return
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
