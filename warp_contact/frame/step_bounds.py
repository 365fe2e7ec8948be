"""How many equal steps a frame takes, and whether they turned out short enough.

    stable  = omega / (2 SAFETY)                     [1/s]  2 / omega is stable without damping
    passing = u / (REACH t)                          [1/s]  nothing jumps through a body
    gentle  = min(u / (TRAVEL e), PATIENCE stable)   [1/s]  an impact does not crush a tet at once
    n       = max(ceil(max(stable, passing, gentle) / fps), floor(KEEP n_last), 1)

All are those of one world: omega the largest frequency of the elastic forces [1/s], u the largest
relative speed [m/s], t the thickness of the thinnest body [m] and e the shortest mean edge of a
body [m], all at the start of the frame. LINGERING replaces TRAVEL while there may be overlaps older
than the step. At the end of the frame the step must still be below ``UNSTABLE`` 2 / omega, and its
damping within ``damping.reach_for``. A frame that fails is repeated at the rates found there.

Implicit steps are stable whatever omega: it is 0 unless a frame failed, or that of a penalty, whose
forces are explicit. They take

    n       = 2^k or 3 2^k >= max(stable, u_b / (STRIDE r_b), RESOLVED) / fps

so that few lengths of steps are in use, each with inverses of its own. u_b is the largest speed of
anything against body b, r_b its thickness, or more where it does not deform (reach.py). RESOLVING
replaces RESOLVED while there may be overlaps older than the step. Where some bodies take explicit
steps beside them, omega, t and e are theirs, passing and gentle count too, and n is no smaller than
in the last frame unless KEEP of the smaller number would do.
"""

import numpy as np

from warp_contact.frame.damping import reach_for
from warp_contact.kernels.lengths import LINGERING, TRAVEL

SAFETY = 0.6  # of the stable step 2 / omega at the start of a frame
UNSTABLE = 0.99  # of the longest stable step at the end of a frame, above which it is repeated
RAISED = 1.2  # times the frequency, at least, in a frame that is repeated
CUT_SHORT = 2.0  # the same, in one that was stopped before its end
EXPLODED = 4.0  # times the frequency that the step was chosen for, at most
REACH = 0.25  # of the thinnest body: the largest relative motion in a step
PATIENCE = 2.0  # times the stable number of steps: more are not taken for TRAVEL or LINGERING
BLURRED = 1.05  # times the stable step: its uncertainty
RESOLVED = 240.0  # implicit steps [1/s] at least: longer ones damp what a frame shows
ONE_PASS = 1920.0  # implicit steps [1/s] at least, where contacts are looked at once a step
RESOLVING = 3840.0  # the same while overlaps last: longer ones turn what is stored into motion
STRIDE = 0.5  # as REACH, in implicit steps
LEAP = 0.6  # of the thinnest body: as REACH, in a step that the user chose; 0.68 lets some pass
# Of the last frame's steps, at least: a step that follows a vibration pumps energy into it.
KEEP = 0.9


def steps_per_second(omega, speed, thickness, edge, overlaps):
    """Steps [1/s] that are stable, and short against the thinnest body and the edges.

    All may be arrays, of one value a world.

    Args:
        omega: largest frequency [1/s]
        speed: largest relative speed [m/s]
        thickness: of the thinnest body [m]
        edge: shortest mean edge of a body [m]
        overlaps: whether some may last: from the start, or because the response leaves them
    """
    stable = omega / (2.0 * SAFETY)
    passing = speed / (REACH * thickness)
    travel = np.where(overlaps, LINGERING, TRAVEL)
    gentle = np.minimum(speed / (travel * edge), PATIENCE * stable)
    return np.maximum(np.maximum(stable, passing), gentle)


def steps_in_frame(per_second, fps: float, last):
    """Whole steps in a frame: ``per_second`` [1/s], at least KEEP of the ``last`` frame's."""
    kept = np.floor(KEEP * np.asarray(last))
    return np.maximum(np.maximum(1, kept), np.ceil(per_second / fps)).astype(int)


def implicit_steps(explicit, crossing, fps: float, rate=RESOLVED, last=0):
    """Whole implicit steps in a frame.

    Args:
        explicit: steps [1/s] that explicit bodies, a penalty and a frame that failed need, else 0
        crossing: largest speed against a body, over its reach [1/s]
        fps: frames a second
        rate: steps [1/s] at least, of each world or of all
        last: steps of the last frame where bodies take explicit ones, else 0
    """
    per_second = np.maximum(np.maximum(explicit, crossing / STRIDE), rate)
    kept = np.minimum(last, _usual(explicit / KEEP / fps))
    return np.maximum(_usual(per_second / fps), kept)


def _usual(least):
    """2^k or 3 2^k steps, no fewer than ``least``."""
    least = np.maximum(least, 1.0)
    power = 2.0 ** np.floor(np.log2(least))
    return np.ceil(power * np.select([least <= power, least <= 1.5 * power], [1.0, 1.5], 2.0))


def with_penalty(omega, stiffness: float, damping: float, inv_mass):
    """Frequency [1/s] with a penalty [N/m], [N s/m] on the lightest vertex, of ``inv_mass`` [1/kg].

    In a rigid body that is what all vertices together move each of them by. Damping is explicit: it
    would turn a velocity round in steps above 1 / (damping inv_mass).
    """
    vibrates = np.sqrt(omega**2 + 4.0 * stiffness * inv_mass)
    return np.maximum(vibrates, 2.0 * damping * inv_mass)


def stays_stable(dt, omega):
    """Whether a step ``dt`` [s] is stable at the frequency ``omega`` [1/s] of its frame's end."""
    return dt * omega <= UNSTABLE * 2.0


def stays_damped(dt, rate, after):
    """Whether the stages for the damping ``rate`` [1/s] suffice for that ``after`` too."""
    return after * dt <= reach_for(rate, dt)


def served(dt):
    """The frequency [1/s] that a step ``dt`` [s] is chosen for, where no other limit counts."""
    return 2.0 * SAFETY / dt


def raised(before, after, dt, least: float = RAISED):
    """Frequency and damping rate [1/s] for the repeat of a frame whose step was too long.

    Args:
        before: at its start
        after: where the step failed; limited, as that state may have begun to explode
        dt: the step [s], which other limits than ``before`` may have shortened
        least: times the frequency, at least
    """
    most = EXPLODED * np.maximum(before[0], served(dt))
    fast = np.minimum(after[1], EXPLODED**2 * np.maximum(before[1], 1.0 / dt))
    slow = np.maximum(least * before[0], after[0])
    return np.minimum(slow, most), np.maximum(before[1], fast)


def explodes(before, after, dt):
    """Whether the rates ``after`` are above what ``raised`` takes for true, or infinite."""
    fast = after[0] > EXPLODED * np.maximum(before[0], served(dt))
    return fast | (after[1] > EXPLODED**2 * np.maximum(before[1], 1.0 / dt))


def repeated(before, after, dt, in_parts):
    """Frequency and damping rate [1/s] for the repeat of a frame: as ``raised``.

    A step that was looked at ``in_parts`` failed before the end of its frame. Where a world is lost
    ``after`` it, it takes twice as many.
    """
    higher = raised(before, after, dt, np.where(in_parts, CUT_SHORT, RAISED))
    doubled = 2.0 * np.stack([np.maximum(before[0], served(dt)), before[1]])
    return np.where(np.isfinite(after).all(axis=0), higher, doubled)


def fault(dt: float, omega: float, speed: float, thickness: float) -> str:
    """Why a step ``dt`` [s] that the user chose cannot be taken; empty if it can.

    The speed matters at the start of a run only: in an impact single vertices are faster.

    Args:
        dt: step [s]
        omega: largest frequency [1/s]
        speed: largest relative speed [m/s]
        thickness: of the thinnest body [m]
    """
    if dt * omega > 2.0 * BLURRED:
        return f"a step of {dt:.3g} s is unstable, the longest stable one is {2.0 / omega:.3g} s"
    if dt * speed > LEAP * thickness:
        way = f"bodies move {dt * speed:.3g} m against each other in a step of {dt:.3g} s"
        return f"{way}, and could pass through the thinnest body, of {thickness:.3g} m"
    return ""
