"""`manifest.json` beside the images of the firmware: of what each was built."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

NAME = "manifest.json"


def sha256(file: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal digits."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def entry(data: Path, images: Iterable[Path], sizes: Mapping[str, int]) -> dict[str, object]:
    """Return what is known of a board.

    Parameters
    ----------
    data
        Its board.h, of which the images were built.
    images
        What is released.
    sizes
        What the program takes of each memory, bytes.
    """
    return {
        "bytes": dict(sizes),
        "board_h_sha256": sha256(data),
        "sha256": {image.name: sha256(image) for image in images},
    }


def check_images(data: Path, images: Iterable[Path], build: str) -> None:
    """Compare a board.h and images with what the manifest beside them says.

    Parameters
    ----------
    data
        The board.h; its folder is named after the board.
    images
        Files in one folder, which are there.
    build
        The command that builds them.

    Raises
    ------
    ConfigError
        If the images were built of another board.h, or the manifest does not know them.
    """
    board = data.parent.name
    for image in images:
        manifest = image.parent / NAME
        known = _read(manifest, board, build)
        if known.get("board_h_sha256") != sha256(data):
            raise ConfigError(
                f"{data}: {image.name} was built of another board.h, with other pins perhaps. Build it anew: "
                f"{build}."
            )
        if known["sha256"].get(image.name) != sha256(image):
            raise ConfigError(f"{image}: it is not the one that {NAME} says. Build it anew: {build}.")


def built_of(data: Path, folder: Path) -> bool:
    """Return whether the manifest in a folder of images says that its board's were built of this board.h."""
    try:
        known = _read(folder / NAME, data.parent.name, "")
    except ConfigError:
        return False
    return known.get("board_h_sha256") == sha256(data)


def _read(manifest: Path, board: str, build: str) -> dict[str, Any]:
    """Return the board's part of a manifest."""
    try:
        known = json.loads(manifest.read_text("utf-8"))["boards"][board]
    except (OSError, ValueError, LookupError, TypeError):
        known = None
    if not (isinstance(known, dict) and isinstance(known.get("sha256"), dict)):
        raise ConfigError(f"{manifest}: it does not say of what {board} was built. Build it anew: {build}.")
    return known
