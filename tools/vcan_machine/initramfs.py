"""The first file system of the machine: modules, busybox, and a script that mounts this computer's."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

MODULES = ("virtio_mmio", "9pnet_virtio", "9p", "overlay", "can_raw", "vcan", "slcan")
HOST, SHARE = "host", "share"  # tags of the two shared folders
SCRIPT, STATUS = "run.sh", "status"  # in the shared folder

INIT = f"""#!/bin/busybox sh
b=/bin/busybox
$b mount -t devtmpfs devtmpfs /dev
while read -r module; do $b insmod "/modules/$module"; done </modules/order
p9=trans=virtio,version=9p2000.L,msize=512000
$b mount -t 9p -o "$p9,ro,cache=loose" {HOST} /host
$b mount -t tmpfs tmpfs /written
$b mkdir /written/upper /written/work
$b mount -t overlay -o lowerdir=/host,upperdir=/written/upper,workdir=/written/work overlay /new
for place in proc sys dev mnt tmp; do $b mkdir -p /new/$place; done
$b mount -t proc proc /new/proc
$b mount -t sysfs sysfs /new/sys
$b mount -t devtmpfs devtmpfs /new/dev
$b mkdir -p /new/dev/pts /new/dev/shm
$b mount -t devpts -o ptmxmode=666 devpts /new/dev/pts
$b mount -t tmpfs tmpfs /new/dev/shm
$b mount -t 9p -o "$p9" {SHARE} /new/mnt
$b chroot /new /bin/sh /mnt/{SCRIPT}
echo $? >/new/mnt/{STATUS}
$b poweroff -f
"""

_FOLDERS = ("bin", "dev", "modules", "host", "written", "new")
_FOLDER_MODE, _PROGRAM_MODE, _FILE_MODE = 0o40755, 0o100755, 0o100644


def initramfs(busybox: bytes, modules: Mapping[str, bytes]) -> bytes:
    """Return it as the kernel wants it, an archive in cpio's format `newc`.

    Parameters
    ----------
    busybox
        Linked statically.
    modules
        By name, in the order in which they are loaded.
    """
    names = "".join(f"{name}\n" for name in modules)
    return b"".join(
        (
            *(_entry(name, _FOLDER_MODE) for name in _FOLDERS),
            _entry("init", _PROGRAM_MODE, INIT.encode()),
            _entry("bin/busybox", _PROGRAM_MODE, busybox),
            _entry("modules/order", _FILE_MODE, names.encode()),
            *(_entry(f"modules/{name}", _FILE_MODE, module) for name, module in modules.items()),
            _entry("TRAILER!!!", 0),
        )
    )


def _entry(name: str, mode: int, data: bytes = b"") -> bytes:
    title = name.encode() + b"\0"
    numbers = (0, mode, 0, 0, 1, 0, len(data), 0, 0, 0, 0, len(title), 0)
    head = b"070701" + b"".join(b"%08X" % number for number in numbers) + title
    return b"".join(part + bytes(-len(part) % 4) for part in (head, data))
