"""Runs a setting and looks at it after each frame, from positions alone where that is possible.

A body is lost when its centre is behind a plane, or when the centres of a watched pair have
swapped along the line that joined them at the start while one is still in front of the other: one
has gone through the other rather than past it.

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
from dataclasses import dataclass

import numpy as np

import warp_contact as wc
from trials.outcome import SUNK, Record

FLOOR = 1e-8
RUNAWAY = 100.0  # gain of energy after which a run is not followed further
ACROSS = 0.5  # of the wider body's middle extent: "in front of" is nearer to the line than this
AGAIN = 0.01  # s after which an alarm that came at a bad moment rings again


@dataclass
class Setting:
    """A scene, how long to run it and what to look at.

    Attributes:
        scene: as it starts
        seconds: how long [s]
        fps: frames per second
        substeps: of a frame; None leaves it to the solver
        pairs: indices of two bodies, and the direction from the first to the second or None for
            the line between their centres; None watches each body and the next
        recovers: it starts with an overlap; only that at the end counts, and no body may pop
        held: lower bound of the elastic energy with that overlap closed before anything moves [J]
        drive: called before each frame; the energy is then not judged
    """

    scene: wc.Scene
    seconds: float
    fps: float = 200.0
    substeps: int | None = None
    pairs: tuple | None = None
    recovers: bool = False
    held: float = 0.0
    drive: Callable | None = None


class Watch:
    """The record of a run as it grows."""

    def __init__(self, sim: wc.Simulation, setting: Setting):
        """Remember the start."""
        self.sim, self.setting = sim, setting
        self.record = Record(asked=setting.seconds)
        bodies = sim.scene.bodies
        extents = [np.sort(np.ptp(b.mesh.vertices, axis=0)) for b in bodies]
        self.size = float(min(e[0] for e in extents))
        self.width = [float(e[1]) for e in extents]
        self._pairs = []
        centre = self.centres()
        pairs = setting.pairs
        if pairs is None:
            pairs = tuple((k, k + 1, None) for k in range(len(bodies) - 1))
        for a, b, axis in pairs:
            axis = centre[b] - centre[a] if axis is None else np.array(axis, dtype=float)
            self._pairs.append((a, b, axis / np.linalg.norm(axis)))
        start = sim.measure()
        self._start, self.record.touched = start.energy, start.overlap > 0.0
        self._scale = self.scale()
        self._flight, self._elastic = 0.0, 0.0

    def scale(self) -> float:
        """What the energy is measured against [J]."""
        now, scene = self.sim.measure(), self.sim.scene
        mobile = self.sim.model.mass.numpy() * (self.sim.model.inv_mass.numpy() > 0.0)
        weight = float(mobile.sum(dtype=float)) * float(np.linalg.norm(scene.gravity))
        stored = sum(young(b) * b.mesh.volume for b in scene.bodies)
        motion = abs(now.kinetic) + now.elastic
        return motion + weight * self.size + FLOOR * stored

    def centres(self) -> list[np.ndarray]:
        """Mean position of each body [m]."""
        return [self.sim.positions(b).astype(float).mean(axis=0) for b in self.sim.scene.bodies]

    def flight(self) -> float:
        """Kinetic energy of the centres of mass of the bodies [J]."""
        mass, v = self.sim.model.mass.numpy().astype(float), self.sim.velocities().astype(float)
        first = self.sim.model.body_vert.numpy()[:-1]
        m = np.add.reduceat(mass, first)
        p = np.add.reduceat(mass[:, None] * v, first)
        return float((0.5 * np.einsum("bi,bi->b", p, p) / m).sum())

    def look(self) -> Record:
        """Add the present state to the record."""
        r, sim = self.record, self.sim
        r.steps += sim.substeps
        r.time = sim.time
        r.finite = bool(np.isfinite(sim.positions()).all() and np.isfinite(sim.velocities()).all())
        if not r.finite:
            return r
        r.volume = min(volume_ratio(b.mesh, sim.positions(b)) for b in sim.scene.bodies)
        r.lowest = min(r.lowest, r.volume)
        r.lost = r.lost or self.wrong_side()
        now = sim.measure()
        r.touched = r.touched or now.n_contacts > 0 or bool(now.forces)
        if not self.setting.recovers:
            r.tunnelled, r.through = now.tunnelled, now.tunnelled_pair
        deepest = now.overlap / self.size
        r.overlap = deepest if self.setting.recovers else max(r.overlap, deepest)
        self._flight = max(self._flight, self.flight())
        self._elastic = max(self._elastic, now.elastic)
        if self.setting.recovers:
            held = max(self._elastic, self.setting.held)
            r.gained = max(0.0, (self._flight - held) / (held + self._scale))
            if self.setting.held > 0.0:
                freed = self._flight / self.setting.held
                seen = self._flight / self._elastic if self._elastic > 0.0 else np.inf
                r.note = f"motion {freed:.2f} of what the overlap holds closed, {seen:.2f} of"
                r.note += " the elastic energy seen"
        elif self.setting.drive is None:
            r.gained = max(r.gained, (now.energy - self._start) / self._scale)
        return r

    def wrong_side(self) -> str:
        """Who is on whose wrong side."""
        centre, bodies = self.centres(), self.sim.scene.bodies
        for p, (n, h) in enumerate(self.sim.scene.planes):
            for body in bodies:
                if centre[body.index] @ n < h - SUNK * self.size:
                    return f"{body.label} is behind plane {p}"
        for a, b, axis in self._pairs:
            apart = centre[b] - centre[a]
            along = float(apart @ axis)
            aside = float(np.linalg.norm(apart - along * axis))
            if along < 0.0 and aside < ACROSS * max(self.width[a], self.width[b]):
                return f"{bodies[b].label} went through {bodies[a].label}"
        return ""


def run(setting: Setting, response, most_steps: int = 10**9, limit: float = 1e6) -> Record:
    """Run a setting to its end, to its first failure for good, or for so many steps or seconds."""
    try:
        sim = wc.Simulation(setting.scene, response, setting.fps, setting.substeps)
    except ValueError as error:
        return Record(refused=str(error), asked=setting.seconds)
    watch = Watch(sim, setting)
    r = watch.record
    try:
        with alarm(limit):
            for _ in range(round(setting.seconds * setting.fps)):
                if setting.drive:
                    setting.drive(sim)
                sim.step_frame()
                watch.look()
                if not r.finite or r.lost or r.gained > RUNAWAY or r.steps >= most_steps:
                    break
    except wc.SimulationError as error:
        if sim.substeps == 0:
            r.refused = str(error)
        else:
            r.error, r.finite = str(error), "finite" not in str(error)
    except TimeoutError:
        r.error = f"frame {sim.frame + 1}: not done after {limit:g} s"
    except Exception as error:  # no run should end like this: it is an outcome, with its kind
        r.error = f"frame {sim.frame + 1}: {type(error).__name__}: {error}"
    return r


@contextmanager
def alarm(seconds: float):
    """Raise TimeoutError in the body after so long: a frame may ask for any number of steps."""

    def ring(_, frame):
        while frame:
            if frame.f_code.co_name == "__del__":  # where an exception would be lost
                signal.setitimer(signal.ITIMER_REAL, AGAIN)
                return
            frame = frame.f_back
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def volume_ratio(mesh: wc.TetMesh, x: np.ndarray) -> float:
    """Smallest volume of a tet over that at rest."""
    a, b, c, d = np.moveaxis(x.astype(float)[mesh.tets], 1, 0)
    volume = np.einsum("mi,mi->m", np.cross(b - a, c - a), d - a) / 6.0
    return float((volume / mesh.volumes).min())


def young(body) -> float:
    """Young's modulus of a body [Pa]."""
    return body.material.youngs_modulus


def stiffness(scene: wc.Scene) -> float:
    """E l of the softest mobile body, l its mean edge [N/m]: the unit for a penalty."""
    mobile = [b for b in scene.bodies if not b.fixed.all()]
    return min(young(b) * mean_edge(b.mesh) for b in mobile)


def mean_edge(mesh: wc.TetMesh) -> float:
    """Mean length of an edge [m]."""
    p, q = mesh.edges.T
    return float(np.linalg.norm(mesh.vertices[p] - mesh.vertices[q], axis=1).mean())
