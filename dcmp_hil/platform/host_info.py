"""Facts about the computer of a run that determine how late a loop can be."""

from __future__ import annotations

import os
import platform
from importlib import import_module
from pathlib import Path
from typing import Any

from dcmp_hil.errors import ConfigError

_CAP_SYS_NICE_BIT, _CAP_IPC_LOCK_BIT = 23, 14  # bits of CAP_SYS_NICE and CAP_IPC_LOCK in linux/capability.h
_PREEMPTION_MODELS = ("PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT_LAZY", "PREEMPT")  # the longer names first
_GOVERNOR_FILE = "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"
_PREEMPTION_FILE = "/sys/kernel/debug/sched/preempt"  # of a dynamic kernel; the one in brackets is in force
_THROTTLING_FILE = "/proc/sys/kernel/sched_rt_runtime_us"
_LOAD_FILE = "/proc/loadavg"
_LINUX_MODULES = ("fcntl", "resource", "termios")


def require_linux(what: str) -> None:
    """Refuse what needs the operating system's own interfaces where they are absent.

    Parameters
    ----------
    what
        The subject of the sentence, such as ``"a paced run"``.

    Raises
    ------
    ConfigError
        Naming what works everywhere.
    """
    for name in _LINUX_MODULES:
        try:
            import_module(name)
        except ImportError:
            raise ConfigError(
                f"{what} works on Linux only: this system's Python has no module {name}. Everywhere: "
                "`dcmp-hil run --fast`, replay, export, paper, check and rigs."
            ) from None


def host_facts() -> dict[str, Any]:
    """Return what there is to say about this computer; None where it does not tell.

    Returns
    -------
    dict
        ``system``, ``kernel``, ``preemption``, ``cpus`` (those this process may use), ``governor`` (of the
        first), ``rt_runtime_us`` (of each second, for real-time threads; -1 for all of it), ``privileges``
        and ``python``.
    """
    throttle = read_fact(_THROTTLING_FILE)
    return {
        "system": platform.system(),
        "kernel": platform.release(),
        "preemption": preemption(platform.version(), read_fact(_PREEMPTION_FILE)),
        "cpus": _cpus(),
        "governor": read_fact(_GOVERNOR_FILE),
        "rt_runtime_us": None if throttle is None else int(throttle),
        "privileges": privileges(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
    }


def in_words(facts: dict[str, Any]) -> str:
    """Return the facts about this computer as one line."""
    return ", ".join(f"{name} {'unknown' if fact is None else fact}" for name, fact in facts.items())


def contention(loadavg: str = _LOAD_FILE, cpus: int | None = None) -> str:
    """Return a clause on the number of ready threads, if it exceeds that of processors.

    Parameters
    ----------
    loadavg
        The path of what proc(5) calls /proc/loadavg.
    cpus
        Processors that this process may use; None asks the system.

    Returns
    -------
    str
        A clause; empty where there is no contention, or the system does not tell.
    """
    fields = (read_fact(loadavg) or "").split()
    running = fields[3].partition("/")[0] if len(fields) > 3 else ""  # noqa: PLR2004 - "0.2 0.1 0.1 3/411 9123"
    threads, available = (int(running) if running.isdecimal() else 0), cpus or _cpus()
    if available is None or threads <= available:
        return ""
    return f"{threads} threads want its {available} processors"


def privileges() -> dict[str, Any]:
    """Return the limits of `ulimit` and the capabilities beyond them; empty outside POSIX."""
    try:
        import resource
    except ImportError:  # no POSIX system
        return {}
    held = capabilities(read_fact("/proc/self/status") or "")
    locked, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    return {
        "uid": os.geteuid(),
        "cap_sys_nice": bool(held >> _CAP_SYS_NICE_BIT & 1),
        "cap_ipc_lock": bool(held >> _CAP_IPC_LOCK_BIT & 1),
        "rtprio_limit": resource.getrlimit(resource.RLIMIT_RTPRIO)[0],
        "memlock_limit": "unlimited" if locked == resource.RLIM_INFINITY else locked,
    }


def _cpus() -> int | None:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count()


def capabilities(status: str) -> int:
    """Return the effective capabilities as a bit mask, from /proc/self/status; 0 if it is silent."""
    for line in status.splitlines():
        if line.startswith("CapEff:"):
            return int(line.removeprefix("CapEff:"), 16)
    return 0


def preemption(version: str, model: str | None) -> str:
    """Return the preemption model of a kernel.

    Parameters
    ----------
    version
        As `uname -v` says it.
    model
        What a dynamic kernel says about the model in force, such as ``none voluntary (full)``; None if it
        may not be read.
    """
    words = version.split()
    flavour = next((name for name in _PREEMPTION_MODELS if name in words), "none")
    if model and "(" in model:
        return f"{flavour} ({model.split('(')[1].split(')')[0]})"
    return flavour


def read_fact(path: str) -> str | None:
    """Return the text of a small file of the kernel's; None where there is none, or none for us."""
    try:
        return Path(path).read_text("utf-8").strip() or None
    except OSError:
        return None
