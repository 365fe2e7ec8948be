"""Checks of a USD file: the registered validators, and what these do not check."""

from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, UsdUtils, Vt

from warp_contact.usd.folder import frame_files
from warp_contact.usd.kept import read_layer
from warp_contact.usd.reader import frame_numbers, in_short, open_stage, read_note

CLIPS = "frames/f.######.usdc"  # the template of the frames

TOPOLOGY = (
    "faceVertexCounts",
    "faceVertexIndices",
    "tetVertexIndices",
    "surfaceFaceVertexIndices",
    "subdivisionScheme",
)
VALIDATED = 0, 26, 3  # the first version whose packages have all that its validators load
DEFAULT = Usd.TimeCode.Default()
TURN_ERROR = 1e-9  # of a rotation: double precision
EXTENT_ERROR = 1e-6  # of the largest coordinate: float32 in another order of operations


def problems(path) -> list[str]:
    """What is wrong with a USD file or an open stage, one line each; empty if nothing is."""
    delegate = UsdUtils.CoalescingDiagnosticDelegate()  # collects what USD would print
    try:
        stage = path if isinstance(path, Usd.Stage) else open_stage(path)
        found = metadata(stage) + misplaced(stage)
        for prim in stage.Traverse():
            if read_note(prim, "body") is not None:
                found += [f"{prim.GetPath()}: {line}" for line in frame_of(stage, prim)]
            if prim.IsA(UsdGeom.Points) or prim.IsA(UsdGeom.Curves):
                found += [f"{prim.GetPath()}: {line}" for line in loose_points(stage, prim)]
            elif prim.IsA(UsdGeom.PointBased):
                found += [f"{prim.GetPath()}: {line}" for line in point_based(stage, prim)]
        found += [d.commentary for d in delegate.TakeUncoalescedDiagnostics()]
        # Last: the validators take the template of the clips for a missing file and warn.
        found += registered(stage)
    except (OSError, ValueError, RuntimeError) as error:  # of Tf too
        found = [in_short(error)]
    finally:
        delegate.TakeUncoalescedDiagnostics()
    return [" ".join(line.split()) for line in dict.fromkeys(found)]


def registered(stage: Usd.Stage) -> list[str]:
    """The errors of the validators that ship with USD, none where it is older than they need."""
    if Usd.GetVersion() < VALIDATED:
        return []
    from pxr import UsdValidation

    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    kind = UsdValidation.ValidationErrorType.Error
    found = [f"{e.GetName()}: {e.GetMessage()}" for e in errors if e.GetType() == kind]
    # Names of folders such as [x] hide the frames from them; ``point_based`` looks for itself.
    return [line for line in found if not ("UnresolvableDependency" in line and CLIPS in line)]


def metadata(stage: Usd.Stage) -> list[str]:
    """Units, axes, rates and range, which only count on the root layer."""
    root, found = stage.GetRootLayer(), []
    wanted = {"upAxis": "Z", "metersPerUnit": 1.0, "kilogramsPerUnit": 1.0}
    for key, value in wanted.items():
        if root.pseudoRoot.GetInfo(key) != value or not root.pseudoRoot.HasInfo(key):
            found.append(f"root layer: {key} is not {value}")
    if not (root.HasTimeCodesPerSecond() and root.timeCodesPerSecond > 0.0):
        found.append("root layer: no timeCodesPerSecond")
    if not root.HasFramesPerSecond() or root.framesPerSecond != root.timeCodesPerSecond:
        found.append("root layer: framesPerSecond is not timeCodesPerSecond")
    if not (root.HasStartTimeCode() and root.HasEndTimeCode()):
        found.append("root layer: no startTimeCode or endTimeCode")
    elif root.endTimeCode < root.startTimeCode:
        found.append("root layer: endTimeCode is before startTimeCode")
    if not stage.GetDefaultPrim():
        found.append("root layer: no defaultPrim")
    return found


def misplaced(stage: Usd.Stage) -> list[str]:
    """Files that hold another frame than their name says; one that is missing is seen later."""
    prim, found = stage.GetDefaultPrim(), []
    if not (prim and prim.HasAuthoredMetadata("clips")):
        return []
    for path in frame_files(Path(stage.GetRootLayer().realPath).parent):
        frame = int(path.name[2:-5]) if path.name[2:-5].isdecimal() else -1
        layer = read_layer(path) if frame in frame_numbers(stage) else None
        if layer is not None and layer.ListAllTimeSamples() != [float(frame)]:
            found.append(f"{path.name} is not frame {frame}: it has {layer.ListAllTimeSamples()}")
    return found


def frame_of(stage: Usd.Stage, prim: Usd.Prim) -> list[str]:
    """Samples of the transform of a rigid body, and whether it keeps the shape."""
    place, n = UsdGeom.Xformable(prim), len(frame_numbers(stage))
    ops = place.GetOrderedXformOps()
    found = odd_samples(stage, prim)
    if n > 1:
        bare = [op.GetOpName() for op in ops if not op.GetTimeSamples()]
        found += [f"{name} has no samples for {n} frames" for name in bare]
    for frame in frame_numbers(stage) if ops else ():
        matrix = np.array(place.GetLocalTransformation(frame))
        turn = matrix[:3, :3]
        off = np.abs(turn @ turn.T - np.eye(3)).max() if np.isfinite(matrix).all() else np.inf
        if off > TURN_ERROR or np.linalg.det(turn) < 0.0:
            found.append(f"it is not turned and moved alone at frame {frame}")
    return found


def odd_samples(stage: Usd.Stage, prim: Usd.Prim) -> list[str]:
    """Attributes with samples at other times than the frames."""
    frames = [float(frame) for frame in frame_numbers(stage)]
    times = {a.GetName(): a.GetTimeSamples() for a in prim.GetAuthoredAttributes()}
    odd = {name: len(at) for name, at in times.items() if at and at != frames}
    return [f"{name} has {n} samples for {len(frames)} frames" for name, n in odd.items()]


def point_based(stage: Usd.Stage, prim: Usd.Prim) -> list[str]:
    """Samples, points, extents, primvars and topology of a Mesh or a TetMesh."""
    frames = [float(frame) for frame in frame_numbers(stage)]
    geometry, body = UsdGeom.PointBased(prim), prim.GetParent()
    sampled = [a for a in prim.GetAuthoredAttributes() if a.GetTimeSamples()]
    found = [f"{a.GetName()} is time-sampled" for a in sampled if a.GetName() in TOPOLOGY]
    found += odd_samples(stage, prim)
    own = geometry.GetPointsAttr().GetTimeSamples()
    moving = prim.IsA(UsdGeom.Mesh) and read_note(body, "body") is not None
    moving = moving and not UsdGeom.Xformable(body).GetOrderedXformOps()
    if moving and not own and len(frames) > 1:
        found.append(f"points has no samples for {len(frames)} frames")
    times = frames if sampled else []
    n = len(geometry.GetPointsAttr().Get(own[0] if own else DEFAULT) or ())
    primvars = UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues()
    lengths, wanted = sizes(prim, n), []
    for primvar in primvars:
        size = lengths.get(primvar.GetInterpolation())
        if size is not None and primvar.GetTypeName().isArray:
            wanted.append((primvar, size))
    for time in times or [DEFAULT]:
        when = "" if time == DEFAULT else f" at frame {time:g}"
        found += [line + when for line in at_time(geometry, time, n, wanted)]
    return found + (tet_mesh(prim, n) if prim.IsA(UsdGeom.TetMesh) else mesh(prim, n))


def loose_points(stage: Usd.Stage, prim: Usd.Prim) -> list[str]:
    """What is wrong with points or curves, of which each frame may have another number."""
    geometry, found = UsdGeom.PointBased(prim), odd_samples(stage, prim)
    primvars = UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues()
    wanted = [p for p in primvars if p.GetInterpolation() == UsdGeom.Tokens.vertex]
    for time in frame_numbers(stage):
        n = len(geometry.GetPointsAttr().Get(time) or ())
        lines = at_time(geometry, time, n, [(p, n) for p in wanted]) if n else []
        if prim.IsA(UsdGeom.Curves):
            counts = UsdGeom.Curves(prim).GetCurveVertexCountsAttr().Get(time)
            lines += [f"curves do not fit its {n} points"] if sum(counts or ()) != n else []
        found += [f"{line} at frame {time}" for line in lines]
    return found


def at_time(geometry: UsdGeom.PointBased, time, n: int, primvars: list) -> list[str]:
    """What is wrong at one time with ``n`` points, their extent, and primvars of given sizes."""
    points = geometry.GetPointsAttr().Get(time)
    if points is None or len(points) != n or n == 0:
        return [f"{0 if points is None else len(points)} points instead of {n or 'some'}"]
    if not np.isfinite(np.asarray(points)).all():
        return ["points are not finite"]
    found, extent = [], geometry.GetExtentAttr().Get(time)
    expected = np.asarray(UsdGeom.PointBased.ComputeExtent(points))
    error = EXTENT_ERROR * float(np.abs(expected).max())
    if extent is None or np.abs(np.asarray(extent) - expected).max(initial=0.0) > error:
        found.append("extent is not that of the points")
    for primvar, size in primvars:
        value = primvar.ComputeFlattened(time) if primvar.IsIndexed() else primvar.Get(time)
        length = 0 if value is None else len(value)
        if length != size * primvar.GetElementSize():
            found.append(
                f"primvar {primvar.GetPrimvarName()} has {length} values instead of {size}"
            )
    return found


def sizes(prim: Usd.Prim, n: int) -> dict[str, int]:
    """Length that a primvar of each interpolation must have; those not listed are not checked."""
    result = {UsdGeom.Tokens.vertex: n, UsdGeom.Tokens.varying: n, UsdGeom.Tokens.constant: 1}
    if prim.IsA(UsdGeom.Mesh):
        counts = UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get() or ()
        result[UsdGeom.Tokens.uniform] = len(counts)
        result[UsdGeom.Tokens.faceVarying] = int(np.sum(counts))
    return result


def mesh(prim: Usd.Prim, n: int) -> list[str]:
    """Faces of a Mesh with ``n`` points."""
    if not prim.IsA(UsdGeom.Mesh):
        return []
    geometry = UsdGeom.Mesh(prim)
    indices = geometry.GetFaceVertexIndicesAttr().Get() or Vt.IntArray()
    counts = geometry.GetFaceVertexCountsAttr().Get() or Vt.IntArray()
    valid, reason = UsdGeom.Mesh.ValidateTopology(indices, counts, n)
    return [] if valid else [reason or "its faces do not fit its points"]


def tet_mesh(prim: Usd.Prim, n: int) -> list[str]:
    """Tets and surface of a TetMesh with ``n`` points."""
    geometry, found = UsdGeom.TetMesh(prim), []
    for name in "tetVertexIndices", "surfaceFaceVertexIndices":
        ids = np.asarray(prim.GetAttribute(name).Get() or ()).ravel()
        if ids.size == 0 or ids.min() < 0 or ids.max() >= n:
            found.append(f"{name} is empty or does not fit its {n} points")
    if not found:
        inverted = UsdGeom.TetMesh.FindInvertedElements(geometry, DEFAULT)
        if len(inverted):
            found.append(f"{len(inverted)} inverted tets at rest, the first is {inverted[0]}")
    return found
