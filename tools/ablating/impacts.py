"""Cases in which bodies strike each other."""

from checks import collision
from verification import collision as free
from verification.setup import Ask

import warp_contact as wc

OVERLAP = "deepest overlap [% of an edge]"
SPIN = "angular momentum [of sum m |x| |v|]"
GAINED = "energy gained [of that at the start]"
APPROACH = "approach left [of that before]"


def tilted() -> dict[str, float]:
    """Collision of tilted blocks."""
    found = collision.collide(collision.build(3, 3, 1.0, "tilted"))
    return {OVERLAP: found[OVERLAP], SPIN: found["angular momentum change [of sum m |x| |v|]"]}


def oblique() -> dict[str, float]:
    """Oblique collision with friction."""
    found = {f.name: f.error for f in free.collide(Ask(), (3, 5), "oblique", 1.0)}
    return {SPIN: found["change of ang. momentum [of sum m |x| |v|]"]}


def struck(speed: float, young: float, fps: float, frames: int) -> dict[str, float]:
    """The overlap after a tilted block has struck another at ``speed`` [m/s]."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0)
    for k, q in enumerate(((0.0, 0.0, 0.0, 1.0), collision.quaternion(collision.ANGLES))):
        rubber = wc.NeoHookean(young, 0.3, 1000.0)
        place, v = (0.0, 0.0, 0.16 * k), (0.0, 0.0, -speed * k)
        scene.add_body(wc.box(0.1, 3), rubber, place, q, velocity=v)
    sim = wc.Simulation(scene, fps=fps)
    edge = float(sim.model.body_edge.numpy().min())
    worst = max(sim.measure().overlap for _ in sim.frames(frames))
    return {OVERLAP: 100.0 * worst / edge}


def hard() -> dict[str, float]:
    """Tilted block at 5 m/s."""
    return struck(5.0, 5e4, 240.0, 24)


def shifted() -> dict[str, float]:
    """Collision of tilted blocks, 2:5 cells, off the middle."""
    found = collision.collide(collision.build(2, 5, 1.0, "tilted shifted"))
    return {GAINED: max(found["largest energy [of that at the start]"] - 1.0, 0.0)}


def thin() -> dict[str, float]:
    """Thin soft plates at 10 m/s."""
    scene, speed = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0), 10.0
    for k in range(2):
        mesh, rubber = wc.box((0.1, 0.1, 0.01), (4, 4, 1)), wc.NeoHookean(300.0, 0.3, 1000.0)
        place, v = (0.004 * k, 0.003 * k, 0.06 * k), (0.0, 0.0, -speed * k)
        scene.add_body(mesh, rubber, place, velocity=v)
    sim = wc.Simulation(scene)
    for _ in sim.frames(2):
        pass
    lower, upper = (float(sim.velocities(body)[:, 2].mean()) for body in scene.bodies)
    return {APPROACH: max(lower - upper, 0.0) / speed}
