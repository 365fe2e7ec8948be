"""A scene in motion: frames, automatic substeps, what a user reads and sets between frames."""

import math
import os
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import warp as wp

from warp_contact import checkpoint, solver, warm
from warp_contact.assemble import assemble
from warp_contact.diagnosis import lost_vertex, vertex_name
from warp_contact.errors import SimulationError
from warp_contact.fields import contact_fields
from warp_contact.forces import share_for, stages_for
from warp_contact.measure import Measure, Meter
from warp_contact.pace import Pace
from warp_contact.progress import Progress
from warp_contact.ready import load_kernels
from warp_contact.response import ContactSurface, Penalty, PredictedForce
from warp_contact.rest import Rest, keep_forces
from warp_contact.room import enlarged
from warp_contact.scene import Body, Scene
from warp_contact.spectrum import Spectrum
from warp_contact.substeps import raised, stays_damped, stays_stable
from warp_contact.types import Capacity, State
from warp_contact.work import Work, allocate_work

NEIGHBOURS = 8  # pairs with a contact force for each body that there is room for at first
UNIT = 1e-13  # momentum of one count of the recorded impulses, for all mobile mass at 1 m/s
HALVED = 3  # times that the steps of a frame are halved because its state did not stay finite
ATTEMPTS = 12  # at a frame, with shorter steps each time


class Simulation:
    """Steps a scene frame by frame.

    Attributes:
        scene: as given
        response: how bodies answer to an overlap
        fps: frames per second
        frame: number of the last finished frame
        substeps: steps of the last frame
        model: what stays constant, as Warp arrays
        state: positions [m] and velocities [m/s] as Warp arrays, shape (n_vert,)
        device: where all of it lives
    """

    def __init__(
        self,
        scene: Scene,
        response: ContactSurface | Penalty | PredictedForce | None = None,
        fps: float = 60,
        substeps: int | None = None,
        device: str | None = None,
        sleeping: bool = False,
    ):
        """Lay out a scene.

        Args:
            scene: bodies and half-spaces
            response: ``ContactSurface()`` by default
            fps: frames per second
            substeps: steps in each frame; None takes the stable step of the assembled system,
                shorter where bodies approach each other fast
            device: ``cpu``, ``cuda:0``, ...; None takes Warp's default
            sleeping: under gravity, bodies at rest are left alone until something comes near: a
                settled pile costs next to nothing, at an accuracy that ``rest`` states

        Raises:
            ValueError: for an empty scene, an unknown device, fps or substeps that are not positive
        """
        if not (math.isfinite(fps) and fps > 0.0):
            raise ValueError(f"fps {fps} is not positive")
        if substeps is not None and (int(substeps) != substeps or substeps < 1):
            raise ValueError(f"substeps {substeps} is not a positive count")
        self.scene = scene
        self.response = ContactSurface() if response is None else response
        self.fps = fps
        self.frame = 0
        self.substeps = 0
        self.device = _device(device)
        with wp.ScopedDevice(self.device):
            self.model, self.state = assemble(scene)
            load_kernels(self.model, self.device)
            self._pace = Pace(self.model, self.response, fps, substeps)
            self._spectrum = Spectrum(self.model)
            self._meter = Meter(self.model)
            # Without weight, what hardly moves need not be held by anything: it flies.
            sleeping = sleeping and any(self.model.gravity)
            self._rest = Rest(self.model, self.state, fps) if sleeping else None
            pairs = max(Capacity.pairs, NEIGHBOURS * self.model.n_body)
            self._work: Work = self._allocate(self.state, Capacity(pairs=pairs))
            self._saved = State(wp.clone(self.state.x), wp.clone(self.state.v))
            self._saved_warm = warm.allocate(self.model.n_vert, self._work.capacity.contacts)
        inv_mass = self.model.inv_mass.numpy()
        mobile = float(self.model.mass.numpy()[inv_mass > 0.0].sum(dtype=np.float64))
        self._unit = UNIT * (mobile if mobile > 0.0 else 1.0)
        self._graphs: dict[tuple[int, bool], wp.Graph] = {}
        self._search: bool | None = None  # whether some overlap was not created by a step
        self._dt: float | None = None
        self._rates: tuple[float, float] | None = None

    @property
    def time(self) -> float:
        """Time of the last finished frame [s]."""
        return self.frame / self.fps

    def frames(self, n: int, progress: bool = False) -> Iterator[int]:
        """Step ``n`` frames and yield the number of each when it is finished.

        Raises:
            SimulationError: a position or velocity is no longer finite; the state stays that of
                the last finished frame
        """
        line = Progress(n) if progress else None
        for _ in range(n):
            self.step_frame()
            if line:
                measured = self.measure()
                line.update(self.frame, self.time, measured.n_contacts, measured.overlap)
            yield self.frame
        if line:
            line.close()

    def step_frame(self) -> None:
        """Step one frame.

        A frame that outgrew its buffers, or whose step turned out too long for the deformation
        that came, is repeated from its start: nothing is lost.
        """
        with wp.ScopedDevice(self.device):
            if self._rest and self._search is False:  # an overlap that is left has to be searched
                if not self._rest.update(self.state, self._work):
                    self._rest.skip_frame(self.state, self._work)
                    self.frame += 1
                    return
            wp.copy(self._saved.x, self.state.x)
            wp.copy(self._saved.v, self.state.v)
            warm.copy(self._saved_warm, self._work.warm)
            while self._search is None or self._grow():
                self._search = solver.overlaps(self.model, self.state, self._work)
            omega, rate = self._rates or self._spectrum.rates(self.state.x)
            self._pace.check(self.state, omega, self.frame + 1)
            last, halved = self.substeps, 0
            for _attempt in range(ATTEMPTS):
                dt = self._run(omega, rate, last)
                while self._grow():
                    dt = self._run(omega, rate, last)
                lost = lost_vertex(self.state)
                if lost is not None:
                    self._restore()
                    if self._pace.wanted or halved == HALVED or lost_vertex(self.state) is not None:
                        raise SimulationError(
                            f"frame {self.frame + 1}: {vertex_name(self.model, lost)} is no longer "
                            f"finite ({self.substeps} substeps)"
                        )
                    halved += 1
                    omega, rate = 2.0 * omega, 2.0 * rate
                    continue
                after = self._spectrum.rates(self.state.x)
                stable = self._pace.wanted is not None or stays_stable(dt, after[0], rate)
                if stable and stays_damped(dt, rate, after[1]):
                    break
                omega, rate = raised((omega, rate), after)
                self._restore()
            else:
                raise SimulationError(
                    f"frame {self.frame + 1}: no stable step found ({self.substeps} substeps)"
                )
            self._rates = after
            self._dt = dt
            self._search = self._search and bool(self._work.deep_found.numpy()[0])
            self.frame += 1

    def positions(self, body: Body | int | None = None) -> np.ndarray:
        """Copy of the positions [m] of one body or of all, shape (n, 3)."""
        return self.state.x.numpy()[self._range(body)].copy()

    def velocities(self, body: Body | int | None = None) -> np.ndarray:
        """Copy of the velocities [m/s] of one body or of all, shape (n, 3)."""
        return self.state.v.numpy()[self._range(body)].copy()

    def set_velocity(self, body: Body | int, velocity, vertices=None) -> None:
        """Set velocities [m/s] between frames; fixed vertices keep theirs from then on.

        Args:
            body: the body
            velocity: shape (3,), or (k, 3) for k vertices
            vertices: mask or ids within the body; None for all
        """
        where = self._range(body)
        v = self.state.v.numpy().copy()
        part = v[where]
        part[slice(None) if vertices is None else np.asarray(vertices)] = velocity
        if not np.isfinite(part).all():
            raise ValueError(f"velocity of body '{self._label(body)}' is not finite")
        v[where] = part
        self.state.v.assign(v)
        if self._rest:
            self._rest.wake(body.index if isinstance(body, Body) else int(body))

    def measure(self) -> Measure:
        """Energies, momenta, overlap, contacts and contact forces of the last frame."""
        with wp.ScopedDevice(self.device):
            duration = 1.0 / self.fps if self.frame else 0.0
            dt = duration / max(self.substeps, 1)
            return self._meter.measure(self.state, self._work, self._unit, duration, dt)

    def contact_fields(self) -> dict[str, np.ndarray]:
        """Per vertex: ``pressure`` [Pa] over the last frame, ``penetration`` [m] and ``partner``.

        The partner is a body's index, n_body + p for plane p, -1 for none; it and the penetration
        are those of the last step, found at its predicted positions; contacts of edges that go on
        from the step before have no penetration. Shapes (n_vert,).
        """
        return contact_fields(self.model, self.state.x, self._work, 1.0 / self.fps)

    def save(self, path: str | os.PathLike) -> None:
        """Write a checkpoint: a run that goes on from it gives the bits of one never interrupted.

        The scene is not in it: build it anew, make a ``Simulation`` of it with the same settings,
        and ``load`` the file. Velocities given to fixed vertices are part of it.
        """
        with wp.ScopedDevice(self.device):
            values = {"x": self.state.x.numpy(), "v": self.state.v.numpy()}
            values |= {"frame": np.array(self.frame), "substeps": np.array(self.substeps)}
            values |= {f"start.{k}": start for k, start in self._spectrum.starts().items()}
            values |= {f"meter.{k}": value for k, value in self._meter.memory().items()}
            values |= {f"warm.{k}": value for k, value in warm.values(self._work.warm).items()}
            if self._rest:
                rest = self._rest.values(self._work)
                values |= {f"rest.{k}": value for k, value in rest.items()}
        if self._search is not None:
            values |= {"search": np.array(self._search)}
        if self._dt is not None:
            values |= {"dt": np.array(self._dt), "rates": np.array(self._rates)}
        checkpoint.write(path, self._fingerprint(), values)

    def load(self, path: str | os.PathLike) -> None:
        """Go on from a checkpoint; until the next frame, only bodies asleep have contact forces.

        Raises:
            OSError: it cannot be read
            ValueError: it is no checkpoint, or one of another scene or other settings
        """
        values = checkpoint.read(path, self._fingerprint())
        with wp.ScopedDevice(self.device):
            self.state.x.assign(values["x"])
            self.state.v.assign(values["v"])
            self._spectrum.start_from(checkpoint.part(values, "start"))
            self._meter = Meter(self.model)
            self._meter.remember(checkpoint.part(values, "meter"))
            rest = checkpoint.part(values, "rest")
            impulses = checkpoint.part(values, "warm")
            have = self._work.capacity
            pairs = max(have.pairs, len(rest.get("pair_key", ())))
            contacts = max(have.contacts, len(impulses["held"]))
            self._replace_work(replace(have, pairs=pairs, contacts=contacts))
            warm.restore(self._work.warm, impulses)
            if self._rest:
                self._rest.restore(rest, self._work)
        self.frame, self.substeps = int(values["frame"]), int(values["substeps"])
        self._search = bool(values["search"]) if "search" in values else None
        self._dt = float(values["dt"]) if "dt" in values else None
        self._rates = tuple(map(float, values["rates"])) if "rates" in values else None

    def _fingerprint(self) -> str:
        sleeping = self._rest is not None
        settings = self.response, self.fps, self._pace.wanted, sleeping
        return checkpoint.fingerprint(self.model, *settings)

    def _run(self, omega: float, rate: float, last: int) -> float:
        """Step one frame at the rates [1/s] given, after ``last`` steps; return the step [s]."""
        work = self._work
        if self._rest:
            self._rest.begin_frame(self.state, work)
        else:
            work.impulse.zero_()
            work.pair_key.fill_(-1)
            work.pair_total.zero_()
        n = self._pace.steps(self.state, omega, last, self.frame + 1, bool(self._search))
        dt = 1.0 / (self.fps * n)
        stages = stages_for(rate, dt)
        if self._dt is not None and dt != self._dt:
            work.dt.fill_(0.5 * (self._dt - dt))
            solver.kick(self.model, self.state, work)  # velocities lag by half a step
        work.dt.fill_(dt)
        work.share.fill_(share_for(rate, dt))
        work.contacts.needed.zero_()
        work.deep_found.zero_()
        work.bodies.rebuild()
        work.steps.fill_(n)
        wp.capture_launch(self._graph(stages))
        self.substeps = n
        return dt

    def _graph(self, stages: int) -> wp.Graph:
        """The captured steps of a frame, with so many stages of damping."""
        key = stages, self._search
        if key not in self._graphs:
            arguments = self.model, self.state, self._work, self.response, *key, self._unit
            with wp.ScopedCapture() as capture:
                solver.steps(*arguments)
            self._graphs[key] = capture.graph
        return self._graphs[key]

    def _allocate(self, state: State, capacity: Capacity) -> Work:
        awake = self._rest.awake if self._rest else None
        return allocate_work(self.model, state, capacity, awake)

    def _grow(self) -> bool:
        """Enlarge the buffers that the frame outgrew, and go back to its start; True if any."""
        work = self._work
        capacity = enlarged(work)
        if capacity is None:
            return False
        self._restore()
        forces = work.impulse, work.pair_key, work.pair_total
        del work
        self._replace_work(capacity)
        if self._rest:
            keep_forces(*forces, self._work)
        return True

    def _replace_work(self, capacity: Capacity) -> None:
        """Allocate anew; old and new buffers at once would be the peak of the memory."""
        before = self._work.capacity
        self._graphs.clear()
        del self._work
        try:
            self._work = self._allocate(self.state, capacity)
            saved = warm.allocate(self.model.n_vert, capacity.contacts)
        except RuntimeError:  # there is no memory for it
            self._work = self._allocate(self.state, before)
            warm.copy(self._work.warm, self._saved_warm)
            raise
        warm.copy(saved, self._saved_warm)
        warm.copy(self._work.warm, saved)
        self._saved_warm = saved

    def _restore(self) -> None:
        wp.copy(self.state.x, self._saved.x)
        wp.copy(self.state.v, self._saved.v)
        warm.copy(self._work.warm, self._saved_warm)

    def _range(self, body: Body | int | None) -> slice:
        if body is None:
            return slice(None)
        index = body.index if isinstance(body, Body) else int(body)
        first, last = self.model.body_vert.numpy()[index : index + 2].tolist()
        return slice(first, last)

    def _label(self, body: Body | int) -> str:
        return self.model.labels[body.index if isinstance(body, Body) else int(body)]


def _device(name: str | None) -> wp.Device:
    try:
        return wp.get_device(name)
    except ValueError:
        known = ", ".join(device.alias for device in wp.get_devices())
        raise ValueError(f"unknown device '{name}'; this machine has {known}") from None
