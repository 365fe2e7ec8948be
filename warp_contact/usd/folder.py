"""The folder of a run: one owner, one root layer, nothing replaced before its successor is whole.

    <dir>/<name>.usda                the root layer; what belongs to it lies beside it
    <dir>/.warp_contact.lock         while somebody writes
    <dir>/.warp_contact.new/         a new run until it is published
    <dir>/.warp_contact.ready/       while it is published
    <dir>/.warp_contact.<process>.*  a file that is being written

The hidden ones are gone after a run. What a killed one left of them, the next one clears away.
"""

import os
import shutil
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from pxr import Sdf, Tf

from warp_contact.files import HIDDEN, sync, sync_all
from warp_contact.usd.lock import Lock
from warp_contact.usd.reader import root_path, roots_in

NEW, READY = f"{HIDDEN}new", f"{HIDDEN}ready"
TOPOLOGY = "topology.usdc"
SYNC_EVERY = 1.0  # what the power of the machine may take of a run [s]
# Of the same length at each frame, so that it can be renewed in place: to replace a file by another
# one takes three times as long, and where the disk is busy milliseconds.
ROOT = """#usda 1.0
(
    defaultPrim = "World"
    endTimeCode = {end:<8}
    framesPerSecond = {fps}
    kilogramsPerUnit = 1
    metersPerUnit = 1
    startTimeCode = {start}
    subLayers = [
        @./topology.usdc@
    ]
    timeCodesPerSecond = {fps}
    upAxis = "Z"
)

over "World" (
    clips = {{
        dictionary default = {{
            asset manifestAssetPath = @./manifest.usdc@
            string primPath = "/World"
            string templateAssetPath = "./frames/f.######.usdc"
            double templateEndTime = {end:<8}
            double templateStartTime = {start}
            double templateStride = 1
        }}
    }}
)
{{
}}

"""


class RunFolder:
    """Owns the folder of a root layer, from its construction until it is closed.

    Attributes:
        root: the root layer
        now: the folder in which the files of the run are to be written now
        replaces: whether something is there that ``publish`` replaces
    """

    def __init__(
        self, path, overwrite: bool = False, resume: bool = False, beside: Iterable[str] = ()
    ):
        """Make sure that nothing will be lost or mixed; nothing is replaced yet.

        Args:
            path: a folder, whose name the root layer takes, or the ``.usda`` root layer itself
            overwrite: whether what is there may be replaced
            resume: whether to go on with what is there
            beside: names of more files of the run

        Raises:
            FileExistsError: something is there, or somebody is at work there
            OSError: the folder cannot be written to
            ValueError: the path cannot be that of a root layer
        """
        self.root = root_path(path)
        folder = self.root.parent
        self._late, self._synced = list[Path | str](), time.monotonic()
        self._made = [p for p in (folder, *folder.parents) if not p.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        try:
            self._lock = Lock(folder / f"{HIDDEN}lock")
        except BaseException:
            self._remove_empty()
            raise
        try:
            clear(folder)
            self._refuse_other_roots()
            self.replaces = not resume and self._is_anything_there(beside, overwrite)
            if not resume:
                frames_of(folder / NEW).mkdir(parents=True)
            self.now = folder if resume else folder / NEW
        except BaseException:
            self.close()
            raise

    @property
    def is_open(self) -> bool:
        """Whether files may be written."""
        return self._lock.release.alive

    def wrote(self, *files: Path | str) -> None:
        """Know files that are not on the disk yet."""
        self._late += files

    def sync(self, every: float = 0.0) -> None:
        """Put them on the disk, unless that was done less than so long ago [s]."""
        if time.monotonic() - self._synced >= every:
            files = dict.fromkeys(map(Path, dict.fromkeys(self._late)))
            sync_all(files | dict.fromkeys(path.parent for path in files))
            self._late.clear()
            self._synced = time.monotonic()

    def publish(self) -> None:
        """Put the new run, as far as it is written, in the place of what is there."""
        folder = self.root.parent
        if self.now != folder:
            self.sync()
            os.rename(self.now, folder / READY)
            self.now = folder
            finish(folder)

    def close(self) -> None:
        """Let others have the folder; what was not published is removed."""
        if self.is_open:
            with suppress(OSError):
                self.sync()
            with suppress(OSError):  # what cannot be done now, the next one does
                clear(self.root.parent)
            self._lock.release()
            self._remove_empty()

    def __enter__(self) -> "RunFolder":
        """Return the folder."""
        return self

    def __exit__(self, *_) -> None:
        """Close it."""
        self.close()

    def _remove_empty(self) -> None:
        """Remove the folders that were made, unless something is in them."""
        with suppress(OSError):
            for folder in self._made:
                folder.rmdir()

    def _refuse_other_roots(self) -> None:
        """A second root layer would show the frames of the first."""
        for other in roots_in(self.root.parent):
            if other != self.root and has_run(other):
                raise FileExistsError(
                    f"{self.root.parent} is the folder of {other.name}: "
                    "give that file to go on with it, or another folder to a new run"
                )

    def _is_anything_there(self, beside: Iterable[str], overwrite: bool) -> bool:
        """Whether the run would replace anything; an error unless it may."""
        folder = self.root.parent
        names = [self.root, self.root.with_suffix(".usdc"), folder / TOPOLOGY]
        names += folder / "manifest.usdc", *(folder / name for name in beside)
        there = [path for path in names if is_there(path)]
        there += frame_files(folder)[:1]
        odd = [path for path in there if not path.is_file()]
        frames = frames_of(folder)
        if is_there(frames) and (frames.is_symlink() or not frames.is_dir()):
            odd.append(frames)  # files are renamed into it, which they cannot across disks
        if odd:
            raise FileExistsError(f"{odd[0]} is in the way: remove it, or choose another folder")
        if there and not overwrite:
            raise FileExistsError(
                f"{there[0]} is there already: go on with it (--resume), replace it (--overwrite), "
                "in Python resume=True or overwrite=True, or choose another folder"
            )
        return bool(there)


def is_there(path: Path) -> bool:
    """Whether there is anything of that name; OSError if there cannot be, as it is too long."""
    try:
        path.lstat()
    except FileNotFoundError:
        return False
    return True


def clear(folder: Path) -> None:
    """Finish or remove what a killed process left half done; the folder is locked."""
    finish(folder)
    shutil.rmtree(folder / NEW, ignore_errors=True)
    for place in (folder, frames_of(folder)):
        for left in place.glob(f"{HIDDEN}[0-9]*"):
            left.unlink(missing_ok=True)


def finish(folder: Path) -> None:
    """Move what is ready into the folder; may be cut short anywhere and done again."""
    ready = folder / READY
    for new in roots_in(ready):
        root = folder / new.name
        root.unlink(missing_ok=True)  # at no moment does it name frames of both
        root.with_suffix(".usdc").unlink(missing_ok=True)
        frames_of(folder).mkdir(exist_ok=True)
        if (ready / TOPOLOGY).exists():  # no new frame is there yet
            for path in frame_files(folder):
                path.unlink()
            os.replace(ready / TOPOLOGY, folder / TOPOLOGY)
        for path in frame_files(ready):
            os.replace(path, frames_of(folder) / path.name)
        for path in ready.iterdir():
            if path.is_file() and path != new:
                os.replace(path, folder / path.name)
        sync(frames_of(folder))
        sync(folder)
        os.replace(new, root)
        sync(folder)
    if ready.exists():
        shutil.rmtree(ready)


def frames_of(folder: Path) -> Path:
    """The folder of the frames."""
    return folder / "frames"


def frame_file(folder: Path, frame: int) -> Path:
    """The file of a frame."""
    return Path(frame_names(folder, frame)[1])


def frame_names(folder: Path, frame: int) -> tuple[str, str]:
    """The file of a frame: while it is written, and then. To make a Path takes as long as both."""
    return f"{folder}/frames/{HIDDEN}{os.getpid()}.usdc", f"{folder}/frames/f.{frame:06d}.usdc"


def frame_files(folder: Path) -> list[Path]:
    """The files of all frames that are there."""
    return sorted(frames_of(folder).glob("f.*.usdc"))


def has_run(root: Path) -> bool:
    """Whether a file is the root layer of a run, whose frames lie beside it."""
    try:
        layer = Sdf.Layer.OpenAsAnonymous(str(root), metadataOnly=True)
    except Tf.ErrorException:
        return False
    return layer is not None and f"./{TOPOLOGY}" in list(layer.subLayerPaths)
