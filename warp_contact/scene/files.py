"""Mesh files. What others read and write is checked: sizes, types and ranges before use."""

import io
import math
import os
import re
import subprocess
import sys
import warnings
import zipfile
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np

from warp_contact import checks
from warp_contact.scene import cells, reading, reading_faces
from warp_contact.scene.topology import MeshError

USD = (".usd", ".usda", ".usdc")
SURFACES = (".stl", ".obj", ".ply", ".off")
FACES = "faces", "usd_faces"  # kinds that reading_faces.py knows
ARRAYS = {"vertices": ("fiu", 3), "tets": ("iu", 4)}  # of an .npz: kinds of numbers, columns
BYTES = 2**31  # of an array: more vertices or tets are no mesh that a machine simulates
SECONDS = 10.0, 2.0  # that a reader may take: for any file, and for each MB of it
MEMORY = 3 * 2**30, 100  # that it may take [bytes]: for any file, and for each byte of it
FEW_THREADS = {  # each thread of a library reserves memory, on machines of many cores too much
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "PXR_WORK_THREAD_LIMIT": "1",
    "MALLOC_ARENA_MAX": "2",
}
USUAL = 1e-4, 10.0  # size [m] of what is simulated: another one may be in another unit
FILL = (
    "fill it first, by gmsh, or by fTetWild (pip install pytetwild pyvista): "
    "pytetwild.tetrahedralize_pv(pyvista.read('{0}')).save('filled.vtu'); "
    "for an obstacle or a rigid body take a shell: wc.shell(wc.Surface.load('{0}'), thickness)"
)


def load(path, prim: str | None, unit: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Vertices [m] and tets in a file; as ``TetMesh.load``."""
    path = regular(path)
    suffix = path.suffix.lower()
    if prim is not None and (not isinstance(prim, str) or suffix not in USD):
        raise checks.refuse("prim", prim, "the path of a TetMesh, and only for a USD file")
    scale = 1.0 if unit is None else checks.positive(unit, "unit", most=1e9)
    if suffix == ".npz":
        x, tets, known = *_load_npz(path), False
    elif suffix in USD:
        x, tets, known = _load_usd(path, prim)
    else:
        x, tets, known = *_load_meshio(path), False
    if known and unit is not None:
        raise ValueError(f"{path}: says its unit itself; leave unit={unit} out")
    if x.dtype.kind not in "fiu":
        raise MeshError(f"{path}: its vertices are of type {x.dtype}, not numbers")
    x = scale * x.astype(np.float64)
    if len(x) and not known and unit is None:
        ask_for_unit(path, x)
    return x, tets


def regular(path) -> Path:
    """The path of a file that can be read from its beginning to its end."""
    path = checks.path(path, "path")
    if not path.exists():
        raise FileNotFoundError(f"no such mesh file: {path}")
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder: give a file in it")
    if not path.is_file():
        raise OSError(f"{path} is no file but a pipe or a device: save what it gives as a file")
    if not path.stat().st_size:
        raise MeshError(f"{path} is empty: write it anew")
    return path


def save(path, vertices: np.ndarray, tets: np.ndarray, surface: np.ndarray) -> None:
    """Write a file; as ``TetMesh.save``."""
    path = checks.path(path, "path")
    suffix = path.suffix.lower()
    if not path.parent.is_dir():
        raise FileNotFoundError(f"no such folder: {path.parent}")
    if suffix in SURFACES:
        raise MeshError(f"{path}: a '{suffix}' holds no tets; write .npz, .usdc or .vtu")
    if suffix == ".npz":
        np.savez_compressed(path, vertices=vertices, tets=tets)
    elif suffix in USD:
        _save_usd(path, vertices, tets, surface)
    else:
        meshio = needed_meshio(path)
        mesh = meshio.Mesh(vertices, [("tetra", tets)])
        try:
            with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
                meshio.write(path, mesh)
        except OSError:
            raise
        except (Exception, SystemExit) as error:  # meshio leaves by sys.exit
            raise MeshError(f"{path}: cannot be written as a '{suffix}' mesh") from error


def in_child(kind: str, path: Path, argument: str = "", size: int | None = None) -> bytes:
    """What ``reading.py`` or ``reading_faces.py`` finds in a file, limited in time and memory.

    Raises:
        MeshError: it cannot be read, and why
    """
    size = path.stat().st_size if size is None else size
    seconds, memory = SECONDS[0] + SECONDS[1] * size / 1e6, MEMORY[0] + MEMORY[1] * size
    script = reading_faces if kind in FACES else reading
    command = [sys.executable, "-P", script.__file__, kind, str(path), argument, str(memory)]
    env = os.environ | FEW_THREADS | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    try:
        done = subprocess.run(
            command,
            env=env,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        late = f"reading it took more than {seconds:.0f} s"
        busy = "it is damaged, or the machine is very busy"
        raise MeshError(f"{path}: {late}: {busy}") from error
    answer = done.stdout
    if answer[:1] == b"-":
        raise MeshError(f"{path}: {answer[1:].decode(errors='replace')}")
    if answer[:1] != b"+" or done.returncode:
        said = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        reason = RuntimeError(said or f"exit code {done.returncode}")
        raise MeshError(
            f"{path}: the reader of '{path.suffix}' files broke down: it is damaged; write it anew"
        ) from reason
    return answer[1:]


def _load_npz(path: Path) -> tuple[np.ndarray, np.ndarray]:
    try:
        with zipfile.ZipFile(path) as archive:
            return tuple(_member(archive, name, *wanted) for name, wanted in ARRAYS.items())
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None
    except Exception as error:
        if isinstance(error, OSError) and error.filename:  # it cannot be opened
            raise
        raise MeshError(f"{path}: is not a readable .npz archive: it is damaged") from error


def _member(archive: zipfile.ZipFile, name: str, kinds: str, columns: int) -> np.ndarray:
    """An array of an archive, whose header is believed only as far as its bytes reach."""
    if f"{name}.npy" not in archive.namelist():
        raise MeshError(f"holds no array '{name}': it needs vertices (n, 3) and tets (m, 4)")
    entry = archive.getinfo(f"{name}.npy")
    if entry.file_size > BYTES:
        raise MeshError(f"its array '{name}' has {entry.file_size} bytes, more than {BYTES}")
    with archive.open(entry) as file:
        version = np.lib.format.read_magic(file)
        if version not in ((1, 0), (2, 0)):
            raise MeshError(f"its array '{name}' is of an unknown version {version}")
        first = version == (1, 0)
        read = np.lib.format.read_array_header_1_0 if first else np.lib.format.read_array_header_2_0
        shape, by_column, dtype = read(file)
        if dtype.kind not in kinds or len(shape) != 2 or shape[1] != columns:
            what = "numbers" if "f" in kinds else "whole numbers"
            raise MeshError(
                f"its array '{name}' has shape {shape} and type {dtype}; "
                f"{what} of shape (n, {columns}) are needed"
            )
        data = file.read()
    if len(data) != math.prod(shape) * dtype.itemsize:
        raise MeshError(f"its array '{name}' is not as long as it says: it is damaged")
    return np.frombuffer(data, dtype).reshape(shape, order="F" if by_column else "C")


def _load_usd(path: Path, prim: str | None) -> tuple[np.ndarray, np.ndarray, bool]:
    found = arrays_of(in_child("usd", path, prim or ""))
    return found["points"], found["tets"], bool(found["has_unit"])


def _load_meshio(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices that volume cells use, and the tets of these."""
    needed_meshio(path)
    found = arrays_of(in_child("meshio", path))
    points, others = found.pop("points"), str(found.pop("others"))
    if not found:
        fill = f"; {FILL.format(path.name)}" if re.search("triangle|quad|polygon", others) else ""
        raise MeshError(f"{path}: holds no tets, only {others or 'points'}{fill}")
    parts = []
    for key, block in found.items():
        name = key.partition(".")[2]
        if block.dtype.kind not in "iu" or block.min(initial=0) < 0:
            raise MeshError(f"{path}: a {name} names a vertex that the file does not hold")
        if block.max(initial=0) >= len(points):
            raise MeshError(f"{path}: a {name} names vertex {block.max()} of {len(points)}")
        parts.append(cells.tets_of(name, block.astype(np.int64)))
    used, tets = np.unique(np.concatenate(parts), return_inverse=True)
    return points[used], tets.reshape(-1, 4)


def arrays_of(data: bytes) -> dict[str, np.ndarray]:
    """The arrays in the answer of ``in_child``."""
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return dict(archive)


def ask_for_unit(path: Path, x: np.ndarray) -> None:
    """Warn of a size that is usual in another unit than the metre."""
    size = float((x.max(axis=0) - x.min(axis=0)).max())
    if size < USUAL[0] or USUAL[1] < size < math.inf:
        warnings.warn(
            f"{path}: {size:.4g} m large, if its unit is the metre; "
            f"unit=1e-3 reads millimetres, unit=1.0 says that it is right",
            stacklevel=4,
        )


def needed_meshio(path: Path):
    """Meshio, which a file asks for; raises MeshError where it is not installed."""
    try:
        import meshio
    except ImportError as error:
        hint = "needs meshio: pip install 'warp_contact[mesh]'"
        raise MeshError(f"{path}: the format '{path.suffix}' {hint}") from error
    return meshio


def _save_usd(path: Path, vertices: np.ndarray, tets: np.ndarray, surface: np.ndarray) -> None:
    from pxr import Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    prim = UsdGeom.TetMesh.Define(stage, "/mesh")
    stage.SetDefaultPrim(prim.GetPrim())
    points = vertices.astype(np.float32)
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    prim.CreateTetVertexIndicesAttr(Vt.Vec4iArray.FromNumpy(tets))
    prim.CreateSurfaceFaceVertexIndicesAttr(Vt.Vec3iArray.FromNumpy(surface))
    prim.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([points.min(0), points.max(0)])))
    stage.Export(str(path))
