"""Reads mesh files with the libraries of others, as a program of its own: ``files.py`` starts it.

    python reading.py meshio|usd|scene|stage PATH ARGUMENT BYTES

Damaged files make such libraries hang, crash or take all memory. Here that can be ended, and the
process that asked lives on. Of ``warp_contact`` only what needs no Warp is imported: that takes a
second.

What goes to stdout is ``+`` and an ``.npz`` archive, or ``-`` and what is wrong with the file.
"""

import io
import math
import os
import re
import sys
import types
import warnings
from contextlib import redirect_stderr, redirect_stdout, suppress

VOLUMES = ("tetra", "pyramid", "wedge", "hexahedron")  # and digits: cells that hold tets


class Unfit(Exception):
    """What is wrong with a file, in words for its user."""


def main(kind: str, path: str, prim: str, limit: str) -> int:
    """Read a file and write what is in it to stdout."""
    out = os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)  # libraries print
    os.dup2(nowhere, 2)
    limit_memory(int(limit))
    said = answer(kind, path, prim)
    with out:
        out.write(said)
    return 0


def answer(kind: str, path: str, prim: str) -> bytes:
    """``+`` and what a reader finds in a file, or ``-`` and what is wrong with it."""
    printed = io.StringIO()
    try:
        with redirect_stdout(printed), redirect_stderr(printed):
            return b"+" + READERS[kind](path, prim)
    except Unfit as error:
        return b"-" + str(error).encode(errors="replace")
    except MemoryError:
        return b"-asks for more memory than a file of its size can need: it is damaged"
    except (Exception, SystemExit) as error:
        left = isinstance(error, SystemExit)  # as meshio does once it has printed why
        reason = in_short(printed.getvalue() if left else f"{type(error).__name__}: {error}")
        wrong = f"cannot be read ({reason}): it is damaged, or its name has the wrong ending"
        return b"-" + wrong.encode(errors="replace")


def limit_memory(size: int) -> None:
    """Let this process have ``size`` bytes, where the system can limit it, and leave no core."""
    try:
        import resource
    except ImportError:  # Windows
        return
    for what, most in (resource.RLIMIT_AS, size), (resource.RLIMIT_CORE, 0):
        hard = resource.getrlimit(what)[1]
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(what, (most, hard))


def packed(**arrays) -> bytes:
    """Arrays as the bytes of an ``.npz`` archive."""
    import numpy as np

    if any(array.dtype.hasobject for array in arrays.values()):
        raise Unfit("holds rows of different lengths where all must have the same")
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def read_meshio(path: str, _) -> bytes:
    """``points``, the blocks of volume cells as ``<number>.<name>``, ``others`` in words."""
    import numpy as np

    mesh = by_meshio(path)
    arrays, others = {"points": np.asarray(mesh.points)}, []
    for k, block in enumerate(mesh.cells):
        if block.type.rstrip("0123456789") in VOLUMES:
            arrays[f"{k}.{block.type}"] = np.asarray(block.data)
        else:
            others.append(f"{len(block.data)} {block.type}")
    return packed(**arrays, others=np.array(", ".join(others)))


def by_meshio(path: str):
    """What meshio finds in a file."""
    import meshio

    if not path.lower().endswith(tuple(meshio.extension_to_filetypes)):
        raise Unfit("its name has no ending that meshio knows, such as .msh, .vtk or .vtu")
    # NumPy before 2.3 goes on with what it could read.
    warnings.filterwarnings("error", "string or file could not be read", DeprecationWarning)
    with suppress(ImportError):  # another version of meshio
        guard_gmsh()
    return meshio.read(path)


def guard_gmsh() -> None:
    """Let meshio refuse numbers of nodes below 1 in gmsh files, which it counts from the end."""
    import numpy as np
    from meshio.gmsh import _gmsh22, _gmsh40, _gmsh41

    def above_zero(key):
        numbers = isinstance(key, np.ndarray) and key.dtype.kind in "iu"
        if numbers and key.astype(np.int64).min(initial=0) < 0:
            raise Unfit("a cell names a vertex that the file does not hold")
        return key

    class Map(np.ndarray):
        """From the number of a node to its place."""

        def __getitem__(self, key):
            return super().__getitem__(above_zero(key))

        def __setitem__(self, key, value):
            super().__setitem__(above_zero(key), value)

    class Guarded:
        """NumPy, with maps for the arrays that readers fill with -1."""

        def __getattr__(self, name):
            return getattr(np, name)

        ones = staticmethod(lambda *given, **more: np.ones(*given, **more).view(Map))
        full = staticmethod(lambda *given, **more: np.full(*given, **more).view(Map))

    for reader in (_gmsh22, _gmsh40, _gmsh41):
        reader.np = Guarded()


def read_usd(path: str, prim: str) -> bytes:
    """``points`` [m] with z up and ``tets`` of a TetMesh; ``has_unit``: whether the file has one.

    It is the first one or that at the path ``prim``, as placed at the earliest time.
    """
    import numpy as np
    from pxr import Usd, UsdGeom

    stage = opened(path)
    found = [p for p in stage.Traverse() if p.IsA(UsdGeom.TetMesh)]
    found = [p for p in found if not prim or str(p.GetPath()) == prim]
    if not found:
        surfaces = sum(p.IsA(UsdGeom.Mesh) for p in stage.Traverse())
        beside = f"; of its {surfaces} surface meshes wc.Surface.load reads one, for wc.shell"
        raise Unfit(f"holds no TetMesh{f' at {prim}' if prim else ''}{beside if surfaces else ''}")
    time = Usd.TimeCode.EarliestTime()
    tetmesh = UsdGeom.TetMesh(found[0])
    points = np.array(tetmesh.GetPointsAttr().Get(time), dtype=float)
    tets = np.array(tetmesh.GetTetVertexIndicesAttr().Get(time))
    if points.ndim != 2 or tets.ndim != 2 or not points.size or not tets.size:
        raise Unfit(f"the TetMesh {found[0].GetPath()} has no points or no tets")
    place = placement(tetmesh, time)
    unit, has_unit = unit_of(stage)
    with np.errstate(over="ignore", invalid="ignore"):
        x = upright(stage, unit * (points @ place[:3, :3] + place[3, :3]))
    return packed(points=x, tets=tets, has_unit=np.array(has_unit))


def placement(prim, time):
    """The matrix from a prim to the world, which acts on row vectors, shape (4, 4)."""
    import numpy as np

    place = np.array(prim.ComputeLocalToWorldTransform(time))
    if not (place[:, 3] == (0.0, 0.0, 0.0, 1.0)).all() or not np.isfinite(place).all():
        raise Unfit(f"the transform of {prim.GetPath()} is not affine and finite")
    return place


def unit_of(stage) -> tuple[float, bool]:
    """Metres per unit of a stage, and whether it says so."""
    from pxr import UsdGeom

    has_unit = stage.HasAuthoredMetadata("metersPerUnit")
    unit = UsdGeom.GetStageMetersPerUnit(stage) if has_unit else 1.0
    if not (math.isfinite(unit) and unit > 0.0):
        raise Unfit(f"its metersPerUnit is {unit}: write a number above zero into it")
    return unit, has_unit


def upright(stage, x):
    """Vectors of a stage, shape (..., 3), with z up where it says that y is."""
    from pxr import UsdGeom

    if stage.HasAuthoredMetadata("upAxis") and UsdGeom.GetStageUpAxis(stage) == "Y":
        return x[..., [0, 2, 1]] * (1.0, -1.0, 1.0)
    return x


def read_scene(path: str, at: str) -> bytes:
    """What ``reading_scene.py`` finds in a stage."""
    package = types.ModuleType("warp_contact")  # without what its __init__ imports
    package.__path__ = [os.path.dirname(os.path.dirname(os.path.abspath(__file__)))]
    sys.modules["warp_contact"] = package
    from warp_contact.scene import reading_scene

    try:
        return packed(**reading_scene.read(opened(path), at))
    except reading_scene.Unfit as error:
        raise Unfit(str(error)) from error


def read_stage(path: str, frames: str) -> bytes:
    """Read every attribute at the earliest time, or at all: what can hang or crash does so here."""
    from pxr import Usd

    stage = opened(path)
    for prim in stage.Traverse():
        for attribute in prim.GetAttributes():
            attribute.Get(Usd.TimeCode.EarliestTime())
            for time in attribute.GetTimeSamples() if frames == "all" else ():
                attribute.Get(time)
    return b""


def opened(path: str):
    """A stage; raises Unfit where USD cannot read it."""
    from pxr import Tf, Usd

    try:
        return Usd.Stage.Open(path)
    except Tf.ErrorException as error:
        raise Unfit(f"is not a readable USD file ({in_short(str(error))})") from error


def in_short(text: str) -> str:
    """The essence of an error of another library in one line; USD quotes it among much else."""
    said = re.findall(r" : '(.*?)'\s*(?:\n|$)", text, re.DOTALL)
    text = re.sub(r"pxrInternal\w*::", "", (said or [text])[0])
    return " ".join(text.split())[:200]


READERS = {"meshio": read_meshio, "usd": read_usd, "scene": read_scene, "stage": read_stage}

if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
