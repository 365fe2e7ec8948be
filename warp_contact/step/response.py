"""How bodies respond to contact: what ``Simulation(response=...)`` takes."""

from dataclasses import dataclass

from warp_contact import checks


@dataclass(frozen=True)
class ContactSurface:
    """The contact surface method of Spillmann & Teschner (2005); no stiffness to choose.

    Attributes:
        search: ``balanced`` solves for equal pressures on both sides at once; ``literal`` is the
            paper as printed: each vertex bisects for itself, displacement before velocities
        iterations: force evaluations of the search in a step
    """

    search: str = "balanced"
    iterations: int = 4

    def __post_init__(self):
        """Raise ValueError for an unknown search or a number of iterations below 2."""
        checks.one_of(self.search, ("balanced", "literal"), "search")
        checks.count(self.iterations, "iterations", least=2, most=1000)


@dataclass(frozen=True)
class Penalty:
    """A force proportional to the penetration depth (Heidelberger et al. 2004).

    Bodies sink in by the load over ``stiffness`` and the number of contacts, and they rock and
    bounce on these springs, which the damping of their materials hardly reaches. The force of a
    frame is then the weight and the change of momentum, so it swings about the weight for long, and
    further with a lower stiffness: compare means over many frames, or give some ``damping``.

    Attributes:
        stiffness: force per depth of each contact [N/m]
        damping: force per normal velocity of each contact [N s/m]
    """

    stiffness: float
    damping: float = 0.0

    def __post_init__(self):
        """Raise ValueError unless stiffness > 0 and damping >= 0."""
        checks.positive(self.stiffness, "penalty stiffness")
        checks.number(self.damping, "penalty damping", least=0.0)

    @property
    def steepness(self) -> float:
        """The most that the force of a contact changes with its depth [N/m]."""
        return self.stiffness


@dataclass(frozen=True)
class VirtualSurface(Penalty):
    """Penalties of the distance to a surface midway between both surfaces (Keiser et al. 2004).

    "Contact handling for deformable point-based objects" (VMV 2004), on triangles in place of
    points; ``impulse/virtual.py`` has the formulas and where they differ from the paper. Where
    faces lie flat on each other it is a ``Penalty`` of half the stiffness, else a weaker one.
    """

    @property
    def steepness(self) -> float:
        """As above: the virtual surface lies half the depth away from both, or less."""
        return 0.5 * self.stiffness


@dataclass(frozen=True)
class PredictedForce:
    """Forces that close the overlaps predicted for the end of the step; nothing to choose.

    After Spillmann, Becker & Teschner, "Non-iterative computation of contact forces for deformable
    objects" (WSCG 2007): one pass over the contacts, without iteration, search or closure. It is a
    reconstruction from the idea, not from the formulas of the paper; those used here stand in
    ``impulse/predicted.py``.
    """
