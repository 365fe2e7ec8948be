"""Picture files: PNG by the standard library alone, animated WebP and GIF with Pillow."""

import struct
import zlib
from collections.abc import Iterable
from pathlib import Path

import numpy as np


def write_png(path, picture: np.ndarray) -> None:
    """Write an (height, width, 3) uint8 array, with Pillow if it is there."""
    try:
        from PIL import Image
    except ImportError:
        Path(path).write_bytes(png(picture))
    else:
        Image.fromarray(picture).save(path)


def read_picture(path) -> np.ndarray | None:
    """Linear colours of a picture, shape (height, width, 3); None if Pillow cannot read it."""
    try:
        from PIL import Image

        with Image.open(path) as image:
            srgb = np.asarray(image.convert("RGB"), dtype=np.float32) / 255.0
    except (ImportError, OSError, ValueError):
        return None
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def png(picture: np.ndarray) -> bytes:
    """A PNG file by the standard library alone."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        checksum = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", checksum)

    height, width, _ = picture.shape
    rows = np.ascontiguousarray(picture, dtype=np.int16).reshape(height, 3 * width)
    rows = np.diff(rows, axis=0, prepend=np.zeros((1, 3 * width), np.int16)).astype(np.uint8)
    lines = np.insert(rows, 0, 2, axis=1)  # filter 2: each byte minus the one above
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(lines.tobytes(), 6))
        + chunk(b"IEND", b"")
    )


def animate(pictures: Iterable, path, fps: float = 30.0) -> None:
    """Join picture files into an animated WebP or GIF, by the suffix of ``path``; needs Pillow.

    A GIF plays at 50 pictures a second at most: viewers slow down a faster one.
    """
    try:
        from PIL import Image
    except ImportError as error:
        raise ImportError("animations need Pillow: pip install 'warp_contact[render]'") from error
    images = [Image.open(picture).convert("RGB") for picture in pictures]
    webp = Path(path).suffix == ".webp"
    options: dict = {"quality": 80, "method": 4} if webp else {}
    images[0].save(
        path,
        save_all=True,
        append_images=images[1:],
        duration=max(round(1000.0 / fps), 1 if webp else 20),
        loop=0,
        **options,
    )
