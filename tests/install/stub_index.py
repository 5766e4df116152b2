"""A package index made of empty wheels: the versions that a lock names, and a newer one of each."""

from __future__ import annotations

import base64
import hashlib
import re
import zipfile
from importlib.metadata import PackageNotFoundError, metadata
from typing import TYPE_CHECKING, NamedTuple

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

NEWER = "9999.0"
_PINNED = re.compile(r"^([A-Za-z0-9._-]+(?:\[[^]]+\])?==[^\s;\\]+)\s*(?:;\s*([^\\]+?))?\s*\\?$")


class Pin(NamedTuple):
    """One line of a lock: a requirement on exactly one version, with its marker."""

    line: str
    requirement: Requirement

    @property
    def version(self) -> str:
        """Version that the lock names."""
        (specifier,) = self.requirement.specifier
        return specifier.version


def pins(lock: Path) -> list[Pin]:
    """Return the pinned requirements of a lock, in its order."""
    found = []
    for line in lock.read_text().splitlines():
        matched = _PINNED.match(line)
        if matched:
            pinned, marker = matched.groups()
            text = f"{pinned} ; {marker}" if marker else pinned
            found.append(Pin(text, Requirement(text)))
    return found


def needs(name: str) -> list[str]:
    """Return the requirements of an installed distribution; none of one that is not installed here."""
    try:
        return metadata(name).get_all("Requires-Dist") or []
    except PackageNotFoundError:
        return []


def write_index(lock: Path, folder: Path) -> Path:
    """Write empty wheels for every pin and for a newer version of each, and a lock with their hashes.

    Parameters
    ----------
    lock
        The project's lock.
    folder
        For the wheels.

    Returns
    -------
    Path
        A lock as the project's, line for line; the hashes are those of the empty wheels.
    """
    stubbed = folder / lock.name
    lines = []
    for pin in pins(lock):
        name = pin.requirement.name
        wheel = write_wheel(folder, name, pin.version, needs(name))
        write_wheel(folder, name, NEWER, needs(name))
        digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
        lines.append(f"{pin.line} --hash=sha256:{digest}\n")
    stubbed.write_text("".join(lines))
    return stubbed


def write_wheel(folder: Path, name: str, version: str, requires: list[str]) -> Path:
    """Write a wheel without content that has the metadata of a real one."""
    stem = f"{canonicalize_name(name).replace('-', '_')}-{version}"
    files = {
        f"{stem}.dist-info/METADATA": "\n".join(_metadata(name, version, requires)) + "\n",
        f"{stem}.dist-info/WHEEL": (
            "Wheel-Version: 1.0\nGenerator: stub\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        ),
    }
    record = "".join(f"{path},{_digest(text)},{len(text)}\n" for path, text in files.items())
    files[f"{stem}.dist-info/RECORD"] = f"{record}{stem}.dist-info/RECORD,,\n"
    wheel = folder / f"{stem}-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        for path, text in files.items():
            archive.writestr(zipfile.ZipInfo(path), text)  # no time stamp: the same bytes, the same hash
    return wheel


def _metadata(name: str, version: str, requires: list[str]) -> Iterator[str]:
    yield from ("Metadata-Version: 2.1", f"Name: {name}", f"Version: {version}")
    extras = sorted(
        {extra for text in requires for extra in re.findall(r"extra\s*==\s*['\"]([^'\"]+)", text)}
    )
    yield from (f"Provides-Extra: {extra}" for extra in extras)
    yield from (f"Requires-Dist: {text}" for text in requires)


def _digest(text: str) -> str:
    digest = hashlib.sha256(text.encode()).digest()
    return "sha256=" + base64.urlsafe_b64encode(digest).rstrip(b"=").decode()
