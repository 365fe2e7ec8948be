"""A4: elastic bars hit a rigid wall and each other; the wave equation gives the whole history.

    c = sqrt(E / rho), contact pressure rho c v (one bar, wall), contact for 2 L / c, e = 1
    two bars: sigma = z1 z2 (v1 - v2) / (z1 + z2), z = rho c

Poisson ratio 0 makes a bar one-dimensional. The impact on a wall is that of Doyen, Ern and Piperno
(2011) without gravity; the pairs follow from d'Alembert's solution (St. Venant): with unequal
lengths or impedances part of the energy stays behind as vibration, and e < 1 without any loss.
The solution is linear in the speed, which here strains the bars by 0.3 %: free bars as slender as
these buckle under the strain of a third that Doyen's numbers mean.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import warp_contact as wc
from verification.figure import Figure, relative, rms, zero
from verification.setup import Ask

FRAMES = 80  # in the time that a wave takes there and back
GAP = 0.05  # at the start, of what the bars travel in that time
AFTER = 0.4  # part of that time to go on after the end of the contact
# At 40 elements symplectic Euler with projection reaches e = 0.976, 0.988 of the energy, 0.15 % of
# the pressure and 1.3 % of the time; implicit Euler at its stable step 0.82, 0.72, 2.7 %.
RESTITUTION = 0.2, 0.05, 0.01
PLATEAU = 0.1, 0.03, 0.01
RELEASE = 0.05, 0.02, 0.005  # of 2 L / c
LOSS = 0.35, 0.1, 0.01  # of the energy at the end
GAIN = 0.01, 0.01, 0.01  # of the energy at any time: no integrator may do that
SUCTION = 0.01, 0.01, 0.001  # of the plateau, after the release


@dataclass(frozen=True)
class Bar:
    """Length [m], Young's modulus [Pa], density [kg/m^3], speed along z [m/s]."""

    length: float
    young: float
    density: float
    speed: float

    @property
    def c(self) -> float:
        """Wave speed [m/s]."""
        return float(np.sqrt(self.young / self.density))

    @property
    def z(self) -> float:
        """Impedance [Pa s/m]."""
        return self.density * self.c


@dataclass(frozen=True)
class Impact:
    """Two bars, the lower first; no second one for a wall below the first.

    Attributes:
        lower, upper: the bars
        contact: how long they touch [s]
        e: coefficient of restitution of the mean velocities
    """

    lower: Bar
    upper: Bar | None
    contact: float
    e: float

    @property
    def pressure(self) -> float:
        """At the interface while both ends have heard nothing of their far ends [Pa]."""
        if self.upper is None:
            return self.lower.z * abs(self.lower.speed)
        z1, z2 = self.lower.z, self.upper.z
        return z1 * z2 * (self.lower.speed - self.upper.speed) / (z1 + z2)

    @property
    def approach(self) -> float:
        """Relative speed [m/s]."""
        return abs(self.lower.speed - (self.upper.speed if self.upper else 0.0))

    @property
    def plateau(self) -> float:
        """How long the pressure stays [s]: until the first wave is back."""
        bars = [self.lower] + ([self.upper] if self.upper else [])
        return min(2.0 * bar.length / bar.c for bar in bars)


FIRST, ROUND = (1.0, 1e6, 1000.0, 0.1), 2.0 / np.sqrt(1e3)  # bar 1 of the pairs, its 2 L / c
IMPACTS = {
    "on a wall": Impact(Bar(10.0, 900.0, 1.0, -0.1), None, 2.0 / 3.0, 1.0),
    "identical": Impact(Bar(*FIRST), Bar(1.0, 1e6, 1000.0, -0.1), ROUND, 1.0),
    "L2 = 2 L1": Impact(Bar(*FIRST), Bar(2.0, 1e6, 1000.0, 0.0), ROUND, 0.5),
    "E2 = 16 E1": Impact(Bar(*FIRST), Bar(1.0, 16e6, 1000.0, 0.0), ROUND, 0.7408),
    "z1 = z2": Impact(Bar(*FIRST), Bar(1.0, 4e6, 250.0, 0.0), 0.25 * ROUND, 0.25),
}
ELEMENTS = 40  # along a bar of length L1; levels are judged there


def run(ask: Ask) -> Iterator[Figure]:
    """Every impact; the full run repeats it on 10 and 160 elements and on cells that differ."""
    for name, impact in IMPACTS.items():
        yield from hit(f"A4 {name}, N = {ELEMENTS}", impact, ask, ELEMENTS)
    if not ask.quick:
        for n in (10, 160):
            yield from hit(f"A4 on a wall, N = {n}", IMPACTS["on a wall"], ask, n)
        yield from hit("A4 identical, 40, 2:3 across", IMPACTS["identical"], ask, 40, (2, 3))


def build(impact: Impact, n: int, across: tuple[int, int]) -> wc.Scene:
    """Bars along z in cubic cells (those of the upper bar finer where ``across`` says so)."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
    cell = impact.lower.length / n
    width = cell * across[0]
    gap = GAP * impact.approach * impact.plateau
    bars = [impact.lower] + ([impact.upper] if impact.upper else [])
    for k, bar in enumerate(bars):
        cells = (across[k], across[k], round(bar.length / width * across[k]))
        mesh = wc.box((width, width, bar.length), cells)
        wall = impact.upper is None
        low = gap if wall else (-bar.length, gap)[k]
        material = wc.Corotated(bar.young, 0.0, bar.density)
        place = (0.0, 0.0, low + 0.5 * bar.length)
        scene.add_body(mesh, material, place, velocity=(0.0, 0.0, bar.speed), label=f"bar{k}")
    if impact.upper is None:
        scene.add_plane((0.0, 0.0, 1.0), 0.0)
    return scene


@dataclass
class History:
    """What an impact showed.

    Attributes:
        time: ends of the frames [s], shape (n,)
        pressure: mean of each frame [Pa], shape (n,)
        energy: of that at the start, shape (n,)
        e: coefficient of restitution
    """

    time: np.ndarray
    pressure: np.ndarray
    energy: np.ndarray
    e: float


def record(impact: Impact, ask: Ask, n: int, across: tuple[int, int] = (1, 1)) -> History:
    """Run an impact; time 0 is the moment at which the rest shapes touch."""
    scene = build(impact, n, across)
    width = impact.lower.length / n * across[0]
    # A contact as stiff as an element of the bar, five times: a penalty that is not seen.
    respond = ask.respond(5.0 * impact.lower.young * width / across[0])
    round_trip = 2.0 * impact.lower.length / impact.lower.c
    sim = wc.Simulation(scene, respond, fps=FRAMES / round_trip)
    touch = GAP * impact.plateau
    mass = sim.model.mass.numpy().astype(float)
    energy = sim.measure().energy
    last = touch + impact.contact + AFTER * round_trip
    rows = []
    for _ in sim.frames(int(np.ceil(last * sim.fps))):
        now = sim.measure()
        pressure = sum(now.forces.values()) / width**2
        rows.append((sim.time - touch, pressure, now.energy / energy))
    speeds = [0.0, 0.0]
    for k, body in enumerate(scene.bodies):
        m = mass[sim.model.vert_body.numpy() == k]
        speeds[k] = float(m @ sim.velocities(body)[:, 2] / m.sum())
    return History(*np.array(rows).T, e=abs(speeds[1] - speeds[0]) / impact.approach)


def release(found: History, impact: Impact) -> float:
    """When the last contact ends [s]: the end of the last frame with a tenth of the pressure.

    A frame that holds the end carries a part of the pressure, by which it is shortened.
    """
    on = np.flatnonzero(found.pressure > 0.1 * impact.pressure)
    if len(on) == 0:
        return float("nan")
    frame = found.time[1] - found.time[0]
    part = min(found.pressure[on[-1]] / impact.pressure, 1.0)
    return float(found.time[on[-1]] - (1.0 - part) * frame)


def hit(
    label: str, impact: Impact, ask: Ask, n: int, across: tuple[int, int] = (1, 1)
) -> Iterator[Figure]:
    """Restitution, pressure, release and energies of an impact."""
    found = record(impact, ask, n, across)
    round_trip = 2.0 * impact.lower.length / impact.lower.c
    yield relative(label, "restitution", found.e, impact.e, RESTITUTION)
    inner = (found.time > 0.15 * impact.plateau) & (found.time < 0.85 * impact.plateau)
    p = found.pressure[inner] / impact.pressure
    yield zero(label, "pressure, rms error of the middle 70 %", rms(p - 1.0), PLATEAU)
    yield relative(label, "pressure, mean of the middle 70 %", p.mean(), 1.0, PLATEAU)
    off = release(found, impact)
    error = (off - impact.contact) / round_trip
    yield Figure(label, "end of the contact [s]", off, impact.contact, error, RELEASE)
    later = found.time > impact.contact + 0.1 * round_trip
    after = found.pressure[later].max() / impact.pressure
    yield zero(label, "largest pressure afterwards [of the plateau]", after, SUCTION)
    lost = 1.0 - found.energy[-1]
    yield Figure(label, "energy at the end [of that at the start]", 1.0 - lost, 1.0, lost, LOSS)
    rise = max(found.energy.max() - 1.0, 0.0)
    yield zero(label, "rise of the energy [of that at the start]", rise, GAIN)
