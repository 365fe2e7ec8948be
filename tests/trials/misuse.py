"""Wrong calls of the public API: each is to be refused with name, value and remedy.

    python tests/trials/misuse.py          # exit code 1 where one is not

Refused means ValueError or OSError, in one line, where the argument is given: before any step, and
without a crash or a hang. ``misuse.txt`` has the calls; ``tests/test_misuse.py`` makes them too.
"""

import os
import re
import signal
import sys
import tempfile
from pathlib import Path

import numpy as np
import warp as wp

import warp_contact as wc

SECONDS = 20  # that a call may take
FOLDER = tempfile.mkdtemp()
CALLS = Path(__file__).with_suffix(".txt")
OPTIONAL = ("unit=", "welded(", "pressure_scale=", ", substeps=", "layers=", "positions(None")
OPTIONAL += ("executor=", "out=", "render=", "stiffness=", "_force=")
NAMES = {"wc": wc, "np": np, "nan": np.nan, "inf": np.inf, "FOLDER": FOLDER}
NAMES |= {"mesh": lambda: wc.box(0.1, 2), "sim": lambda: NAMES["_sim"]}
NAMES |= {"surface": lambda: wc.Surface(NAMES["mesh"]().vertices, NAMES["mesh"]().surface)}
NAMES |= {"npz": lambda: wc.box(0.1, 2).save(f"{FOLDER}/mesh.npz") or f"{FOLDER}/mesh.npz"}
NAMES |= {"writer": lambda **given: wc.UsdWriter(anew(), NAMES["_sim"], **given)}


def anew() -> str:
    """A place for a run where nothing is."""
    return f"{tempfile.mkdtemp(dir=FOLDER)}/run"


def scene() -> wc.Scene:
    """Two blocks."""
    result = wc.Scene()
    for k, name in enumerate("ab"):
        rubber = wc.NeoHookean(1e5, 0.3, 1000.0)
        result.add_body(wc.box(0.1, 2), rubber, (0.0, 0.0, 0.2 * k), label=name)
    return result


def add(**given) -> wc.Body:
    """Add a block to a scene, some of its arguments replaced."""
    block = {"mesh": wc.box(0.1, 2), "material": wc.NeoHookean(1e5, 0.3, 1000.0)}
    return scene().add_body(**block | {"position": (1.0, 0.0, 0.0)} | given)


def attach(**given) -> wc.Attachment:
    """Attach a block to the world at a point, some of the arguments replaced."""
    return scene().attach(**{"a": "a", "kind": "ball", "at": (0.0, 0.0, 0.05)} | given)


def calls() -> list[str]:
    """All wrong calls."""
    found, everywhere = [], []
    for line in CALLS.read_text(encoding="utf-8").splitlines():
        first, *wrong = line.removeprefix("* ").split(" | ")
        if line.startswith("*"):
            everywhere = [first, *wrong]
        elif line and not line.startswith("#"):
            optional = any(word in first for word in OPTIONAL)
            wrong += [value for value in everywhere if value != "None" or not optional]
            found += [first.replace("{}", value) for value in wrong]
    return found


def answer(call: str) -> str:
    """What is wrong with the answer to a call; nothing if it is refused as it should be."""
    if "_sim" not in NAMES:
        NAMES["_sim"] = wc.Simulation(scene())
    try:
        eval(call, NAMES | {"scene": scene, "add": add, "attach": attach})
    except (ValueError, OSError) as error:
        text = str(error)
        plain = "\n" not in text and len(text) < 400 and not re.search(r"\w+Error:", text)
        return "" if plain else f"unclear: {text}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return "taken"


def main() -> int:
    """Make all calls and name those with a wrong answer."""
    wp.config.log_level = wp.LOG_WARNING
    signal.signal(signal.SIGALRM, lambda *_: os._exit(1))
    wrong = 0
    for call in calls():
        signal.alarm(SECONDS)
        said = answer(call)
        wrong += bool(said)
        if said:
            print(f"{call}\n    {said}", flush=True)
    print(f"{len(calls())} calls, {wrong} with a wrong answer")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
