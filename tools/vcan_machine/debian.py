"""Debian's kernel and busybox, unpacked without installation."""

from __future__ import annotations

import lzma
import re
import subprocess
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

META_PACKAGE = "linux-image-amd64"  # the one for clouds has no CAN
_BUSYBOX = "busybox-static"
_LIST_S, _FETCH_S, _UNPACK_S = 120, 300, 120
_XZ = b"\xfd7zXZ\0"


class UnavailableError(RuntimeError):
    """The kernel cannot be had here."""


class Unpacked(NamedTuple):
    """Files of a machine: kernel, busybox and modules."""

    kernel: bytes
    modules: dict[str, Path]  # by name, with underscores
    busybox: bytes


def unpack(folder: Path) -> Unpacked:
    """Fetch the packages from the archive that this system installs from, and unpack them into a folder.

    Parameters
    ----------
    folder
        Empty; takes 600 MB.

    Raises
    ------
    UnavailableError
        If this is no Debian, or its archive cannot be reached.
    """
    lists, cache, root = (folder / name for name in ("lists", "cache", "root"))
    for place in (lists / "partial", cache / "archives" / "partial", root):
        place.mkdir(parents=True)
    ours = ("-o", f"Dir::State::Lists={lists}", "-o", f"Dir::Cache={cache}", "-o", "APT::Sandbox::User=")
    _call(["apt-get", *ours, "update", "-qq"], folder, _LIST_S)
    shown = _call(["apt-cache", *ours, "show", "--no-all-versions", META_PACKAGE], folder, _LIST_S)
    found = re.search(r"^Depends:.*?\b(linux-image-\d\S*)", shown, re.MULTILINE)
    if found is None:
        raise UnavailableError(f"{META_PACKAGE} names no kernel in this system's archive. Use Debian.")
    _call(["apt-get", *ours, "download", "-qq", found[1], _BUSYBOX], folder, _FETCH_S)
    for package in sorted(folder.glob("*.deb")):
        _call(["dpkg-deb", "-x", str(package), str(root)], folder, _UNPACK_S)
    return Unpacked(
        _without_wrapper(next(root.glob("boot/vmlinuz-*")).read_bytes()),
        {_name(path): path for path in root.rglob("*.ko*")},
        next(path for path in root.glob("**/bin/busybox")).read_bytes(),
    )


def _without_wrapper(image: bytes) -> bytes:
    """Return the kernel inside a compressed one, which takes the machine seconds to unpack by itself."""
    at = image.find(_XZ)
    if at < 0:
        return image
    kernel = lzma.LZMADecompressor().decompress(image[at:])
    return kernel if kernel.startswith(b"\x7fELF") else image


def in_order(names: Sequence[str], modules: dict[str, Path]) -> dict[str, bytes]:
    """Return modules with those that they need, each after what it needs; those built in are left out.

    Parameters
    ----------
    names
        Of those that are wanted.
    modules
        All there are, by name with underscores; compressed or not.
    """
    ordered: dict[str, bytes] = {}

    def add(name: str) -> None:
        file = modules.get(name)
        if file is None or name in ordered:
            return
        module = lzma.decompress(file.read_bytes()) if file.suffix == ".xz" else file.read_bytes()
        needs = re.search(rb"\0depends=([^\0]*)\0", module)
        for other in filter(None, needs[1].decode().split(",") if needs else ()):
            add(other.replace("-", "_"))
        ordered[name] = module

    for name in names:
        add(name)
    return ordered


def _name(module: Path) -> str:
    return module.name.partition(".")[0].replace("-", "_")


def _call(command: list[str], folder: Path, seconds: int) -> str:
    try:
        done = subprocess.run(  # noqa: S603 - our own
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=seconds,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise UnavailableError(
            f"{command[0]} cannot be run ({error}). The kernel is Debian's: use Debian."
        ) from error
    if done.returncode:
        said = " ".join(done.stderr.split())
        raise UnavailableError(
            f"{' '.join(command)}: {said}. Look at the network and /etc/apt, then try again."
        )
    return done.stdout
