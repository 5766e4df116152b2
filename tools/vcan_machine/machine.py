"""Making the machine, and running a command in it."""

from __future__ import annotations

import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from tools.vcan_machine.debian import in_order, unpack
from tools.vcan_machine.initramfs import HOST, INIT, MODULES, SCRIPT, SHARE, STATUS, initramfs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

QEMU = "qemu-system-x86_64"
INSTALL = "apt install --no-install-recommends qemu-system-x86 iproute2"
CONSOLE = "console.txt"  # in the shared folder: what was printed
_RUN_TIMEOUT_S = 1200  # wall, on a computer that does much else: nothing may take longer
_KILL_DELAY_S = 5
_SHOWN_CONSOLE_CHARS = 2000  # characters of the console that an error shows
_KEPT_VARIABLES = ("PATH", "HOME", "LANG", "XDG_CACHE_HOME", "CC")

# Time in the machine is counted in its instructions, 1 ns each, and stands still while it computes nothing
# and waits for a timer: however busy this computer is, nothing in there comes late.
_MACHINE_OPTIONS = shlex.split("-M microvm,rtc=on -accel tcg -cpu max -icount shift=0,sleep=off -m 1024")
_PLAIN_OPTIONS = shlex.split("-no-user-config -nodefaults -nographic -no-reboot -serial stdio")
_KERNEL_OPTIONS = "console=ttyS0 quiet panic=-1 mitigations=off audit=0 random.trust_cpu=on"


class Machine(NamedTuple):
    """A virtual machine under QEMU."""

    kernel: Path
    initramfs: Path


def missing() -> str:
    """Return what this computer lacks, and the command that installs it; empty if nothing."""
    if platform.machine() != "x86_64":
        return f"the machine with CAN shares this computer's programs: x86_64, not {platform.machine()}"
    absent = [tool for tool in (QEMU, "ip", "apt-get", "dpkg-deb") if shutil.which(tool) is None]
    return f"no {', '.join(absent)} here: {INSTALL}" if absent else ""


def machine() -> Machine:
    """Return the machine from the user's cache; fetch its kernel if it is not there yet.

    Raises
    ------
    UnavailableError
        If it cannot be fetched.
    """
    made = place()
    if not made.initramfs.exists():
        _make(made)
    return made


def place() -> Machine:
    """Return where the machine is, or will be."""
    key = hashlib.sha256(repr((INIT, MODULES)).encode()).hexdigest()[:16]
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    folder = cache / "dcmp-hil" / f"machine-{key}"
    return Machine(folder / "vmlinux", folder / "initramfs")


def _make(made: Machine) -> None:
    folder = made.kernel.parent
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        parts = unpack(Path(temporary))
        _write(made.kernel, parts.kernel)
        _write(made.initramfs, initramfs(parts.busybox, in_order(MODULES, parts.modules)))


def run(command: Sequence[str], share: Path, *, folder: Path, settings: Mapping[str, str]) -> int:
    """Run a command in the machine and return its exit code.

    Parameters
    ----------
    command
        Of this computer, whose files are there under the same names.
    share
        A folder that the machine sees as /mnt, and may write to; CONSOLE is in it.
    folder
        Where the command is run.
    settings
        Environment, besides a few variables that are passed on.

    Raises
    ------
    UnavailableError
        If its kernel cannot be fetched.
    RuntimeError
        If the machine did not come to its end in time.
    """
    made = machine()
    passed_on = {name: os.environ[name] for name in _KEPT_VARIABLES if name in os.environ}
    exports = "".join(f"export {n}={shlex.quote(v)}\n" for n, v in {**passed_on, **settings}.items())
    script = f"cd {shlex.quote(str(folder))} || exit\n{exports}exec {shlex.join(command)}\n"
    (share / SCRIPT).write_text(script)
    (share / STATUS).unlink(missing_ok=True)
    _start(_qemu(made, share), share / CONSOLE)
    try:
        return int((share / STATUS).read_text())
    except (OSError, ValueError):
        last = (share / CONSOLE).read_text(errors="replace")[-_SHOWN_CONSOLE_CHARS:]
        raise RuntimeError(f"The machine ended before its command did. Its console: {last}") from None


def _start(qemu: list[str], console: Path) -> None:
    """Start the machine and wait for its end; if this process is killed meanwhile, `timeout` ends it."""
    bounded = ["timeout", f"--kill-after={_KILL_DELAY_S}", str(_RUN_TIMEOUT_S), *qemu]
    with (
        console.open("wb") as output,
        subprocess.Popen(  # noqa: S603 - our own
            bounded, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT
        ) as process,
    ):
        try:
            process.wait()
        finally:
            process.terminate()


def _qemu(made: Machine, share: Path) -> list[str]:
    return [
        QEMU,
        *_MACHINE_OPTIONS,
        *_PLAIN_OPTIONS,
        *("-kernel", str(made.kernel), "-initrd", str(made.initramfs), "-append", _KERNEL_OPTIONS),
        *_shared(HOST, Path("/"), "readonly=on,multidevs=remap"),
        *_shared(SHARE, share.resolve(), "multidevs=remap"),
    ]


def _shared(tag: str, path: Path, how: str) -> tuple[str, ...]:
    place = str(path).replace(",", ",,")
    backing = f"local,id={tag},path={place},security_model=none,{how}"
    return "-fsdev", backing, "-device", f"virtio-9p-device,fsdev={tag},mount_tag={tag}"


def _write(path: Path, data: bytes) -> None:
    """Write beside the target and rename: two processes at once do no harm."""
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
        file.write(data)
    Path(file.name).replace(path)
