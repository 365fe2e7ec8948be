"""A scene in motion: frames, automatic substeps, what a user reads and sets between frames."""

import os
from collections.abc import Iterable, Iterator

import numpy as np
import warp as wp

from warp_contact import checks
from warp_contact.between_frames import BetweenFrames
from warp_contact.contact_data import ContactData
from warp_contact.exclusive import exclusively
from warp_contact.frame import checkpoint, memory
from warp_contact.frame.implicit_shapes import find_shapes
from warp_contact.frame.integrator import KINDS as INTEGRATORS
from warp_contact.frame.integrator import choose, reason
from warp_contact.frame.load_kernels import load_kernels
from warp_contact.frame.moves import Moves
from warp_contact.frame.some_worlds import begin_anew
from warp_contact.frame.stepper import Stepper
from warp_contact.frame.surroundings import Surroundings
from warp_contact.joined import Joined
from warp_contact.measure.measure import Measure, Meter
from warp_contact.measure.skins import Skins
from warp_contact.progress import Progress
from warp_contact.scene.assemble import assemble
from warp_contact.scene.scene import Scene
from warp_contact.scene.selection import Bodies
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce

RATES = 1e-6, 1e12  # of frames [1/s]
RESPONSES = ContactSurface | Penalty | PredictedForce
KNOWN = "one of wc.ContactSurface(), wc.Penalty(stiffness), wc.PredictedForce(), "
KNOWN += "wc.VirtualSurface(stiffness)"


class Simulation(BetweenFrames, ContactData, Joined):
    """Steps a scene frame by frame.

    Attributes:
        scene: as given
        response: how bodies respond to contact
        fps: frames per second
        frame: number of the last finished frame
        model: what stays constant, as Warp arrays
        state: positions [m] and velocities [m/s] as Warp arrays, shape (n_vert,); the velocities
            are those of half a step before, ``velocities`` has those of the same time
        device: where the arrays are
    """

    def __init__(
        self,
        scene: Scene,
        response: RESPONSES | None = None,
        fps: float = 60,
        substeps: int | None = None,
        device: str | None = None,
        sleeping: bool = False,
        max_substeps: int = 50_000,
        integrator: str = "explicit",
    ):
        """Lay out a scene.

        Args:
            scene: bodies and half-spaces; nothing can be added to it or changed afterwards
            response: ``ContactSurface()`` by default
            fps: frames per second
            substeps: steps in each frame; None takes the stable step of the assembled system,
                shorter where bodies approach each other fast
            device: ``cpu``, ``cuda:0``, ...; None takes Warp's default
            sleeping: under gravity, islands at rest are left alone until something comes near: a
                settled pile costs next to nothing, at an accuracy that ``frame/sleeping.py`` states
            max_substeps: a frame that needs more of them ends the run, with its reason
            integrator: ``explicit``, or ``implicit`` for few long steps, whatever the stiffness:
                these damp vibrations faster than the step, and impacts lose more energy. Bodies of
                more than 800 vertices take explicit ones beside them. ``auto`` takes what is
                cheaper, see ``summary``

        Raises:
            ValueError: for an empty scene, an unknown device, response or integrator, fps or
                substeps that are not positive, a response that takes no implicit steps
        """
        response = ContactSurface() if response is None else response
        self.scene = checks.instance(scene, Scene, "scene", "a wc.Scene")
        self.response = checks.instance(response, RESPONSES, "response", KNOWN)
        self.fps, self.frame = checks.number(fps, "fps", *RATES), 0
        substeps = None if substeps is None else checks.count(substeps, "substeps")
        max_substeps = checks.count(max_substeps, "max_substeps")
        sleeping = checks.flag(sleeping, "sleeping")
        checks.one_of(integrator, INTEGRATORS, "integrator")
        self.device = _device(device)
        with exclusively(self.device):
            self._lay_out(integrator, substeps, max_substeps, sleeping)

    def _lay_out(
        self, integrator: str, substeps: int | None, max_substeps: int, sleeping: bool
    ) -> None:
        self.model, self.state = of = assemble(self.scene)
        self.scene.freeze()
        self._bodies = Bodies(self.model, self.scene)
        self._integrator = choose(integrator, *of, self.response)
        load_kernels(self.model, self.device, self._integrator.implicit)
        x = np.concatenate([body.x for body in self.scene.bodies]).astype(np.float32)
        shapes = (
            find_shapes(self.model, x.astype(np.float64)) if self._integrator.implicit else None
        )
        self._stepper = Stepper(
            *of, self.response, self.fps, substeps, max_substeps, sleeping, shapes
        )
        self._meter, self._moves = Meter(self.model, self._stepper.work.ties), Moves()
        self._skins = Skins(self.scene, self.model)
        self._surroundings = Surroundings(self.model)

    @property
    def substeps(self) -> int:
        """Steps of the last frame, of the world that took most."""
        return int(self._stepper.last.n.max())

    def summary(self) -> str:
        """One line: how large the scene is, what steps it takes and why."""
        m, chosen = self.model, self._integrator
        size = f"{m.n_body} bodies, {m.n_vert} vertices, {m.n_tet} tets"
        with exclusively(self.device):
            return f"{size}; {chosen.name} steps: {reason(chosen, m, self.state)}"

    @property
    def time(self) -> float:
        """Time of the last finished frame [s]."""
        return self.frame / self.fps

    def frames(self, n: int, progress: bool = False) -> Iterator[int]:
        """Step ``n`` frames and yield the number of each when it is finished.

        Raises:
            SimulationError: a position, velocity or stiffness is no longer finite, or no step is
                stable; the state stays that of the last finished frame
        """
        n, progress = checks.count(n, "n", least=0), checks.flag(progress, "progress")
        return self._frames(n, progress)

    def _frames(self, n: int, progress: bool) -> Iterator[int]:
        with Progress(n, quiet=not progress) as line:
            if progress:
                line.expect(self.next_substeps())
            for _ in range(n):
                self.step_frame()
                if progress:
                    measured = self.measure()
                    line.update(self, measured)
                yield self.frame

    def next_substeps(self) -> int:
        """Steps that the next frame takes, unless they prove too long on the way.

        Raises:
            SimulationError: as ``frames``
        """
        with exclusively(self.device):
            return self._stepper.foresee(self.frame + 1)

    def step_frame(self) -> None:
        """Step one frame.

        A frame that outgrew its buffers, or whose step turned out too long for the deformation
        that came, is repeated from its start: nothing is lost.

        Raises:
            SimulationError: as ``frames``
        """
        with exclusively(self.device), self._moves.frame(self.state, self.fps) as at:
            self._wake_bodies(at)
            self._stepper.step(self.frame + 1)
        self.frame += 1

    def reset(self, worlds: Iterable[int] | None = None) -> None:
        """Begin anew: the next frames give the bits of the first ones.

        With ``worlds``, these alone begin anew, in almost all trials with these bits too; ``frame``
        and others go on, and gravity, friction and restitution stay.

        Raises:
            ValueError: no body is in one of the worlds
        """
        if worlds is None:
            with exclusively(self.device):
                self._stepper.reset()
                self._moves.clear()
                self._surroundings.reset()
                if self.model.restitution.numpy().any():
                    self._stepper.buffers.let_rebound()
                self._meter = Meter(self.model, self._stepper.work.ties)
            self.frame = 0
            return
        of_body, stepper = self.model.body_world.numpy(), self._stepper
        chosen = list(worlds)
        for world in chosen:
            if not (of_body == world).any():
                raise ValueError(f"no body is in world {world!r}")
        own = np.isin(of_body, chosen)
        with exclusively(self.device):
            self._meter.tunnelling.follow(self.state.x)
            self._moves.end(np.flatnonzero(own[self.model.vert_body.numpy()]), self.state)
            begin_anew(stepper, self.model, self.state, np.isin(np.unique(of_body), chosen))
            self._meter.tunnelling.jump(self.state.x, own)
            stepper.wrench.forget(own)
            if self.model.ties:
                joined = own[self.model.ties.body[:, 0]]
                stepper.work.ties.mend(joined)
                stepper.wrench.driven[joined] = 0.0

    def measure(self) -> Measure:
        """Energies, momenta, overlap, contacts and contact forces of the last frame."""
        with exclusively(self.device):
            s = self._stepper
            given = s.velocities(), s.work, self._duration, s.last_dt
            return self._meter.measure(self.state, *given)

    def save(self, path: str | os.PathLike) -> None:
        """Write a checkpoint: a run that continues from it gives the bits of one never interrupted.

        The scene is not in it: build it anew, make a ``Simulation`` of it with the same settings,
        and ``load`` the file. Velocities given to fixed vertices are part of it.
        """
        checkpoint.write(checks.path(path, "path"), self._fingerprint(), self._values())

    def _values(self) -> dict[str, np.ndarray]:
        """What a checkpoint holds; on a CPU some are the arrays themselves, and not copies."""
        with exclusively(self.device):
            values = {"x": self.state.x.numpy(), "v": self.state.v.numpy()}
            values |= {"frame": np.array(self.frame)} | memory.values_of(self._stepper)
            of_meter, moves = self._meter.tunnelling.memory(), self._moves.values()
            values |= checkpoint.ungroup({"meter": of_meter, "moves": moves})
            return values | checkpoint.ungroup({"surroundings": self._surroundings.values()})

    def load(self, path: str | os.PathLike) -> None:
        """Continue from a checkpoint; until the next frame only bodies asleep have contact forces.

        Raises:
            OSError: it cannot be read
            ValueError: it is no checkpoint, or one of another scene or other settings
        """
        self._continue(checkpoint.read(checks.path(path, "path"), self._fingerprint()))

    def _continue(self, values: dict[str, np.ndarray]) -> None:
        """Go back to what ``_values`` gave."""
        with exclusively(self.device):
            self.state.x.assign(values["x"])
            self.state.v.assign(values["v"])
            self._surroundings.restore(**checkpoint.group(values, "surroundings"))
            memory.restore(self._stepper, values)
            self._meter = Meter(self.model, self._stepper.work.ties)
            self._meter.tunnelling.remember(checkpoint.group(values, "meter"))
            self._moves.restore(checkpoint.group(values, "moves"))
        self.frame = int(values["frame"])

    def _fingerprint(self) -> str:
        return checkpoint.fingerprint(
            self.model,
            self._surroundings.first,
            response=self.response,
            fps=self.fps,
            substeps=self._stepper.wanted,
            sleeping=self._stepper.sleeping is not None,
            integrator=self._integrator.name,
        )


def _device(name: str | None) -> wp.Device:
    known = ", ".join(device.alias for device in wp.get_devices())
    if not isinstance(name, str | wp.Device | None):
        raise checks.refuse("device", name, f"a name: this machine has {known}")
    try:
        return wp.get_device(name)
    except ValueError:
        raise ValueError(f"unknown device '{name}'; this machine has {known}") from None
