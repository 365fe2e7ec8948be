"""Disks that are full, and processes that are killed, at a chosen call of the file system."""

import errno
import os
import shutil
import threading
from pathlib import Path

from pxr import Sdf

from warp_contact.usd import writer

CHANGES = ("fsync", "replace", "rename", "unlink", "mkdir", "rmdir")


class Full:
    """The disk is full from call ``k`` on of those that take room on it, or wait for it."""

    def __init__(self, monkeypatch, k: int):
        """Until ``monkeypatch`` is undone."""
        self.left = k
        for owner, name in (
            (os, "fsync"),
            (os, "replace"),
            (os, "rename"),
            (os, "mkdir"),
            (Sdf.Layer, "Export"),
            (Path, "write_text"),
            (writer, "renew"),
        ):
            monkeypatch.setattr(owner, name, self._limited(getattr(owner, name)))

    def _limited(self, whole):
        def limited(*args, **options):
            self.left -= 1
            if self.left < 0:
                raise OSError(errno.ENOSPC, "No space left on device")
            return whole(*args, **options)

        return limited


class Kills:
    """Copies of a folder as a process leaves it that is killed before each change.

    Attributes:
        copies: the folders
        done: what ``said`` was at each of them
        said: to be set by what is watched
    """

    def __init__(self, monkeypatch, folder: Path, copies: Path):
        """Until ``monkeypatch`` is undone."""
        self.folder, self.place, self.copies, self.done, self.said = folder, copies, [], [], None
        self._is_copying, self._lock = False, threading.RLock()  # many wait for the disk at once
        for name in CHANGES:
            monkeypatch.setattr(os, name, self._watched(getattr(os, name)))

    def _watched(self, whole):
        def watched(*args, **options):
            with self._lock:
                if self.folder.exists() and not self._is_copying:
                    self.copies.append(self.place / f"kill{len(self.copies)}" / self.folder.name)
                    self.done.append(self.said)
                    self._is_copying = True
                    shutil.copytree(self.folder, self.copies[-1])
                    self._is_copying = False
            return whole(*args, **options)

        return watched
