"""Files for ``fuzz_files.py``: as they should be, damaged, and crafted to be refused."""

import io
import random
import re
import shutil
import struct
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS / "scene")]
NUMBERS = "nan inf -inf 1e39 -1 0 1e300 99999999999 4294967296 2147483648 1e-320 None () [] 1e9 7"
TEXTS = (".usda", ".obj", ".stl", ".ply", ".vtu")
NUMBER = re.compile(rb"-?\d+(\.\d+)?(e-?\d+)?")


def damaged(file: Path, rng: random.Random) -> bytes:
    """A file with some bytes, or numbers of a text, replaced, lost or added.

    Every other ``.npz`` is packed anew after that, so that its check sums are right.
    """
    if file.suffix == ".npz" and rng.random() < 0.5:
        with zipfile.ZipFile(file) as archive:
            arrays = {name: archive.read(name) for name in archive.namelist()}
        name, packed = rng.choice(sorted(arrays)), io.BytesIO()
        with zipfile.ZipFile(packed, "w") as archive:
            for other, data in arrays.items():
                archive.writestr(other, spoilt(data, False, rng) if other == name else data)
        return packed.getvalue()
    return spoilt(file.read_bytes(), file.suffix in TEXTS or file.stem == "text", rng)


def spoilt(data: bytes, text: bool, rng: random.Random) -> bytes:
    """Bytes of a file, some of them replaced, lost or added."""
    d = bytearray(data)
    if text and rng.random() < 0.65:
        for _ in range(rng.choice([1, 1, 2, 4])):
            first, last = rng.choice([m.span() for m in NUMBER.finditer(d)] or [(0, 1)])
            d[first:last] = rng.choice(NUMBERS.split()).encode()
        return bytes(d)
    where, size = rng.randrange(len(d)), rng.choice([1, 4, 8, 64])
    kind = rng.randrange(7)
    if kind == 0:
        del d[where:]
    elif kind < 3:
        for _ in range(rng.choice([1, 1, 2, 5, 20])):
            value = rng.choice([0, 255, 127, 128]) if kind == 1 else rng.randrange(256)
            d[rng.randrange(len(d))] = value
    elif kind == 3:
        d[where : where + size] = b"\xff" * size
    elif kind == 4:
        del d[where : where + size]
    elif kind == 5:
        d[where:where] = rng.randbytes(size)
    else:
        value = rng.choice([2**62, -1, 2**31, 10**9, 2**40, 0])
        d[where : where + 8] = struct.pack("<q", value)
    return bytes(d)


def whole_files(folder: Path) -> list[Path]:
    """Files as they should be: meshes of several formats, a surface, and a run of three frames."""
    import fake_simulation
    import meshio

    import warp_contact as wc

    mesh = wc.box(1.0, 2)
    folder.mkdir(parents=True, exist_ok=True)
    for ending in ("npz", "usda", "usdc", "usd", "msh", "vtk", "vtu"):
        mesh.save(folder / f"mesh.{ending}")
    tets = meshio.Mesh(mesh.vertices, [("tetra", mesh.tets)])
    surface = meshio.Mesh(mesh.vertices, [("triangle", mesh.surface)])
    meshio.write(folder / "text.msh", tets, file_format="gmsh22", binary=False)
    meshio.write(folder / "text.vtk", tets, file_format="vtk42", binary=False)
    for ending in ("stl", "obj", "ply"):
        meshio.write(folder / f"surface.{ending}", surface)
    fake_simulation.written(folder / "run", 3)
    return sorted(p for p in folder.rglob("*") if p.is_file())


def crafted() -> dict[str, bytes]:
    """Files that are to be refused, by their names; those of the tests."""
    import test_files as tests

    found, one = {}, tests.header((1, 4), "<i4") + np.arange(4, dtype="<i4").tobytes()
    for k, (given, _) in enumerate(tests.ARRAYS.values()):
        data = io.BytesIO()
        np.savez(data, **{"vertices": tests.MESH.vertices, "tets": tests.MESH.tets} | given)
        found[f"arrays{k}.npz"] = data.getvalue()
    for k, n in enumerate((10**9, 10**12, 2**62, -1, 2**63, 0)):
        data = io.BytesIO()
        tests.archive(data, tests.header((n, 3), "<f8"), one)
        found[f"shape{k}.npz"] = data.getvalue()
    for ending in ("npz", "usda", "usdc", "usd", "msh", "vtk", "vtu", "stl", "obj", "xyz"):
        found[f"empty.{ending}"], found[f"text.{ending}"] = b"", b"hello\n" * 50
        found[f"random.{ending}"] = random.Random(1).randbytes(3000)
    return found


def trials(folder: Path, n: int, rng: random.Random) -> Iterator[tuple[str, Path]]:
    """Commands and paths of crafted and of ``n`` damaged files, each as it is to be read."""
    whole, run, copy = whole_files(folder / "whole"), folder / "whole" / "run", folder / "copy"
    (folder / "crafted").mkdir(exist_ok=True)
    for name, data in crafted().items():
        (folder / "crafted" / name).write_bytes(data)
        yield "load", folder / "crafted" / name
    weights = [20 if file.suffix == ".npz" else 1 for file in whole]  # the others take a process
    for k in range(n):
        file = rng.choices(whole, weights)[0]
        data = damaged(file, rng)
        shutil.rmtree(copy, ignore_errors=True)
        if "run" in file.parts:
            shutil.copytree(run, copy)
            (copy / "run.usda").rename(copy / "copy.usda")
            part = copy / file.relative_to(run)
            part = part.with_name("copy.usda") if part.name == "run.usda" else part
            part.write_bytes(data)
            yield rng.choice(["info", "validate", "render"]), copy
        else:
            copy.mkdir()
            (copy / f"damaged{k}{file.suffix}").write_bytes(data)
            usd = file.suffix.startswith(".usd")
            choice = ["load", "load", "info", *(["validate", "render"] if usd else [])]
            yield rng.choice(choice), copy / f"damaged{k}{file.suffix}"
