"""A4: elastic bars hit a rigid wall and each other; the wave equation gives the whole history.

    c = sqrt(E / rho), contact pressure rho c v (one bar, wall), contact for 2 L / c, e = 1
    two bars: sigma = z1 z2 (v1 - v2) / (z1 + z2), z = rho c

Poisson ratio 0 makes a bar one-dimensional. The impact on a wall is that of Doyen, Ern and Piperno
(2011) without gravity; the pairs follow from d'Alembert's solution (St. Venant): with unequal
lengths or impedances part of the energy stays behind as vibration, and e < 1 without any loss.
The solution is linear in the speed, which here strains the bars by 0.3 %: free bars as slender as
these buckle under the strain of a third that Doyen's numbers mean.

When unequal bars part is decided by waves that have been through them several times, smeared out by
the lumped mesh on the way. The same in exact contact on the same mesh, shown beside it, tells what
of the error is due to the contact; four times as many elements leave a part of it.
"""

from typing import NamedTuple

import numpy as np
from measure.figure import Figure, Figures, relative, rms, zero

import warp_contact as wc
from verification.setup import gradients, masses, on_face, watch

FRAMES = 80  # in the time that a wave takes there and back
GAP = 0.05  # at the start, of what the bars travel in that time
AFTER = 0.4  # part of that time to go on after the end of the contact
# At 40 elements symplectic Euler with projection reaches e = 0.976, 0.988 of the energy, 0.15 % of
# the pressure and 0.3 % of the time; implicit Euler at its stable step 0.82, 0.72, 2.7 %.
RESTITUTION = 0.2, 0.05, 0.01
PLATEAU = 0.1, 0.03, 0.01
RELEASE = 0.05, 0.02, 0.005  # of 2 L / c
LOSS = 0.35, 0.1, 0.01  # of the energy at the end
GAIN = 0.01, 0.01, 0.01  # of the energy at any time: no integrator may do that
SUCTION = 0.01, 0.01, 0.001  # of the plateau, after the release


class Bar(NamedTuple):
    """Length [m], Young's modulus [Pa], density [kg/m^3], speed along z [m/s]."""

    length: float
    young: float
    density: float
    speed: float

    @property
    def round_trip(self) -> float:
        """How long a wave takes there and back [s]."""
        return float(2.0 * self.length * np.sqrt(self.density / self.young))


class Impact(NamedTuple):
    """What meets what, and what comes of it."""

    bars: tuple[Bar, ...]  # from below; a single one falls onto a wall
    contact: float  # how long they touch [s]
    e: float  # coefficient of restitution of the mean velocities
    # Pressure just before they part, of the first: (z2 - z1) / (z2 + z1) for each time that a wave
    # came back through the upper bar until then.
    left: float = 1.0

    @property
    def approach(self) -> float:
        """Relative speed [m/s]."""
        return abs(self.bars[0].speed - sum(bar.speed for bar in self.bars[1:]))

    @property
    def pressure(self) -> float:
        """At the interface while both ends have heard nothing of their far ends [Pa]."""
        return self.approach / sum(1.0 / float(np.sqrt(b.young * b.density)) for b in self.bars)

    @property
    def plateau(self) -> float:
        """How long the pressure stays [s]: until the first wave is back."""
        return min(bar.round_trip for bar in self.bars)

    @property
    def frame(self) -> float:
        """Duration of a frame [s]."""
        return self.bars[0].round_trip / FRAMES


FIRST, ROUND = Bar(1.0, 1e6, 1000.0, 0.1), 2.0 / np.sqrt(1e3)  # bar 1 of the pairs, its 2 L / c
IMPACTS = {
    "on a wall": Impact((Bar(10.0, 900.0, 1.0, -0.1),), 2.0 / 3.0, 1.0),
    "identical": Impact((FIRST, Bar(1.0, 1e6, 1000.0, -0.1)), ROUND, 1.0),
    "L2 = 2 L1": Impact((FIRST, Bar(2.0, 1e6, 1000.0, 0.0)), ROUND, 0.5),
    "E2 = 16 E1": Impact((FIRST, Bar(1.0, 16e6, 1000.0, 0.0)), ROUND, 0.7408, 0.6**3),
    "z1 = z2": Impact((FIRST, Bar(1.0, 4e6, 250.0, 0.0)), 0.25 * ROUND, 0.25),
}
ELEMENTS = 40  # along a bar of length L1
# In cells of 6 mm single precision of positions of 2 m strains by 2e-5. At a strain of 0.3 % that
# adds up to 1 to 11 % of the energy in the 5000 steps of an impact, less with the square of the
# speed; at ten times the speed the longest bar buckles.
UNEQUAL, FINE, FASTER = ("L2 = 2 L1", "E2 = 16 E1"), 160, 5


def run(quick: bool) -> Figures:
    """Every impact; the full run adds coarser and finer bars."""
    cases = [(f"{name}, N = {ELEMENTS}", impact, ELEMENTS) for name, impact in IMPACTS.items()]
    if not quick:
        cases += [(f"on a wall, N = {n}", IMPACTS["on a wall"], n) for n in (10, 160)]
        name = f"{{}}, N = {FINE}, {FASTER} times as fast"
        cases += [(name.format(pair), faster(IMPACTS[pair]), FINE) for pair in UNEQUAL]
    for name, *case in cases:
        yield from hit(f"A4 {name}", *case)


def faster(impact: Impact) -> Impact:
    """The same at ``FASTER`` times the speed."""
    return impact._replace(bars=tuple(b._replace(speed=FASTER * b.speed) for b in impact.bars))


def build(impact: Impact, n: int) -> tuple[wc.Scene, float]:
    """Bars along z, one cubic cell wide, and their width [m]."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
    width = impact.bars[0].length / n
    gap = impact.approach * GAP * impact.plateau
    for k, bar in enumerate(impact.bars):
        mesh = wc.box((width, width, bar.length), (1, 1, round(bar.length / width)))
        low = -bar.length if k == 0 and len(impact.bars) > 1 else gap
        place = (0.0, 0.0, low + 0.5 * bar.length)
        material = wc.Corotated(bar.young, 0.0, bar.density)
        scene.add_body(mesh, material, place, velocity=(0.0, 0.0, bar.speed))
    if len(impact.bars) == 1:
        scene.add_plane((0.0, 0.0, 1.0), 0.0)
    return scene, width


def record(impact: Impact, n: int) -> tuple:
    """Run an impact: what it shows in each frame, and the coefficient of restitution.

    In each frame the mean pressure [Pa], the energy at the end, of that at the start, the number of
    steps, and the time at the end [s], 0 when the rest shapes touch.
    """
    scene, width = build(impact, n)
    sim = wc.Simulation(scene, fps=1.0 / impact.frame)
    energy = sim.measure().energy
    touch = GAP * impact.plateau
    last = touch + impact.contact + AFTER * impact.bars[0].round_trip

    def look() -> tuple[float, ...]:
        now = sim.measure()
        pressure = sum(now.forces.values()) / width**2
        return pressure, now.energy / energy, sim.substeps, sim.time - touch

    found = watch(sim, int(np.ceil(last / impact.frame)) * impact.frame, look).T
    body, mass = sim.model.vert_body.numpy(), masses(sim)
    speeds = np.bincount(body, mass * sim.velocities()[:, 2]) / np.bincount(body, mass)
    return *found, float(abs(speeds[-1] - sum(speeds[:-1])) / impact.approach)


def release(time: np.ndarray, pressure: np.ndarray, impact: Impact) -> float:
    """When the last contact ends [s]: the end of the last frame with a tenth of the last pressure.

    A frame that holds the end carries a part of that pressure, by which it is shortened.
    """
    last = impact.left * impact.pressure
    end = np.flatnonzero(pressure > 0.1 * last)[-1]
    return float(time[end] - (1.0 - min(pressure[end] / last, 1.0)) * impact.frame)


def hit(label: str, impact: Impact, n: int) -> Figures:
    """Restitution, pressure, release and energies of an impact."""
    pressure, energy, steps, time, e = record(impact, n)
    round_trip, plateau = impact.bars[0].round_trip, impact.plateau
    yield relative(label, "restitution", e, impact.e, RESTITUTION)
    p = pressure[(time > 0.15 * plateau) & (time < 0.85 * plateau)] / impact.pressure
    yield zero(label, "pressure, rms error of the middle 70 %", rms(p - 1.0), PLATEAU)
    yield relative(label, "pressure, mean of the middle 70 %", p.mean(), 1.0, PLATEAU)
    off = release(time, pressure, impact)
    error = (off - impact.contact) / round_trip
    yield Figure(label, "end of the contact [s]", off, impact.contact, error, RELEASE)
    if impact.e < 1.0:
        scene, width = build(impact, n)
        impulse = collide(scene, impact.frame, steps.astype(int))
        there = release(time, impulse / (impact.frame * width**2), impact)
        error = (there - impact.contact) / round_trip
        name = "end, exact contact on the same mesh [s]"
        yield Figure(label, name, there, impact.contact, error)
        apart = 100.0 * (off - there) / round_trip
        yield Figure(label, "end, difference of both [% of 2 L / c]", apart)
    after = pressure[time > impact.contact + 0.1 * round_trip].max() / impact.pressure
    yield zero(label, "largest pressure afterwards [of the plateau]", after, SUCTION)
    left, name = energy[-1], "energy at the end [of that at the start]"
    yield Figure(label, name, left, 1.0, 1.0 - left, LOSS)
    rise = max(energy.max() - 1.0, 0.0)
    yield zero(label, "rise of the energy [of that at the start]", rise, GAIN)


def collide(scene: wc.Scene, frame: float, steps: np.ndarray) -> np.ndarray:
    """Two bars in exact contact: the impulse between them in each frame [N s].

        m (v' - v) = -h K u + j,  j = max(0, -(v_n + g / h)) / (1 / m1 + 1 / m2),  u' = u + h v'

    Tets, lumped masses and steps (so many of each frame [s]) are the simulator's, the elasticity is
    linear, and the vertices of one end meet those of the other one by one. The impulse j is the
    least that leaves no overlap at the end of the step (Carpenter, Taylor and Katona 1991). Without
    search, weights, closure and single precision, what differs from the simulator is due to these.
    """
    lower, upper = scene.bodies
    below = np.flatnonzero(on_face(lower.mesh, 2, 1))
    above = np.flatnonzero(on_face(upper.mesh, 2, -1))
    start = upper.x[above, 2] - lower.x[below, 2]
    above += len(lower.x)
    grad = np.concatenate([gradients(b.x, b.mesh.tets) for b in scene.bodies])
    stiff = np.concatenate([b.material.youngs_modulus * b.mesh.volumes for b in scene.bodies])
    tets = np.concatenate([lower.mesh.tets, upper.mesh.tets + len(lower.x)])
    quarter = [0.25 * b.material.density * b.mesh.volumes for b in scene.bodies]
    mass = np.bincount(tets.ravel(), np.repeat(np.concatenate(quarter), 4))
    reduced = 1.0 / (1.0 / mass[below] + 1.0 / mass[above])
    at = (3 * tets[:, :, None] + np.arange(3)).ravel()  # where a tet's forces are among all
    v = np.concatenate([lower.v, upper.v])
    u, impulses = np.zeros_like(v), np.zeros(len(steps))
    for k, n in enumerate(steps):
        h = frame / n
        for _ in range(n):
            # K u, that of the energy V E eps : eps / 2, eps = sym(grad u)
            strain = np.einsum("tci,tcj->tij", u[tets], grad)
            strain = 0.5 * (strain + strain.swapaxes(1, 2)) * stiff[:, None, None]
            pull = np.bincount(at, (grad @ strain).ravel(), u.size).reshape(u.shape)
            v -= h * pull / mass[:, None]
            gap = start + u[above, 2] - u[below, 2]
            j = np.maximum(0.0, v[below, 2] - v[above, 2] - gap / h) * reduced
            v[below, 2] -= j / mass[below]
            v[above, 2] += j / mass[above]
            u += h * v
            impulses[k] += j.sum()
    return impulses
