"""Counts in pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray


def pixels(picture: Path) -> NDArray[np.int16]:
    """Return a picture, shape (height, width, 3)."""
    with Image.open(picture) as image:
        return np.asarray(image.convert("RGB"), dtype=np.int16)


def near(picture: Path, colour: tuple[int, int, int], within: int = 24) -> NDArray[np.bool_]:
    """Return which pixels are of about this colour, shape (height, width)."""
    found: NDArray[np.bool_] = np.abs(pixels(picture) - np.array(colour)).max(axis=-1) < within
    return found


def coloured(picture: Path, colour: tuple[int, int, int]) -> int:
    """Return the number of pixels of about this colour."""
    return int(near(picture, colour).sum())
