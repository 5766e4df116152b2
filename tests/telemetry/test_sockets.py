"""In a network of its own without a route: which ports listen, and which connections are tried."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

import pytest

from dcmp_hil.telemetry.rerun import viewer as window
from tests.namespaces import in_own_namespace

_INSIDE = r"""
import json, subprocess, sys, time
from pathlib import Path
from dcmp_hil.telemetry.rerun import viewer as window

subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
FILES = ("tcp", "tcp6", "udp", "udp6")

def sockets():
    found = set()
    for name in FILES:
        path = Path("/proc/net") / name
        for line in path.read_text().splitlines()[1:] if path.exists() else ():
            words = line.split()
            if words[3] == "0A" or name.startswith("udp"):
                found.add((name, words[1].rpartition(":")[0]))
    return found

def unreachable():
    keys, values = (line.split() for line in Path("/proc/net/snmp").read_text().splitlines()[:2])
    return int(dict(zip(keys, values))["OutNoRoutes"])

if sys.argv[1] == "leak":  # so that the test can fail
    import socket
    server = socket.create_server(("0.0.0.0", 0))
    probe = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        probe.sendto(b"", ("192.0.2.1", 9))
    except OSError:
        pass
    print(json.dumps({"code": 0, "sockets": sorted(sockets()), "unreachable": unreachable(), "seen": 1}))
    sys.exit()

command = [sys.executable, "-m", "dcmp_hil", "run", "--no-record", "--duration", "5", "--viewer", sys.argv[1]]
run = subprocess.Popen(command)
found, viewer, seen = set(), None, 0
while run.poll() is None:
    found |= sockets()
    if viewer is None and window.answers(window.VIEWER_PORT, 0.01):
        seen = 1
        viewer = subprocess.Popen(
            [window.viewer_binary(), "--headless", "--bind", "127.0.0.1", "--port", "auto",
             "--memory-limit", "300MB", "--connect", window.proxy_url(window.VIEWER_PORT)],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=window.viewer_environment())
    time.sleep(0.02)
if viewer is not None:
    viewer.terminate()
    viewer.wait()
told = {"code": run.returncode, "sockets": sorted(found), "unreachable": unreachable(), "seen": seen}
print(json.dumps(told))
"""
_LOOPBACK = {"0100007F", "00000000000000000000000001000000", "0000000000000000FFFF00000100007F"}


def _alone(mode: str) -> dict[str, Any]:
    """Run in a network of its own; return what was seen there."""
    environment = {k: v for k, v in os.environ.items() if k not in {"DISPLAY", "WAYLAND_DISPLAY", "CI"}}
    done = subprocess.run(
        [*in_own_namespace("net"), sys.executable, "-c", _INSIDE, mode],
        check=False, capture_output=True, text=True, timeout=90.0, env=environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    seen: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return seen


@pytest.mark.parametrize("mode", ["none", "connect", "serve", "web"])
def test_listeners_are_on_loopback_only_and_no_connection_goes_out(mode: str) -> None:
    seen = _alone(mode)
    assert seen["code"] == 0
    assert {address for _, address in seen["sockets"]} <= _LOOPBACK
    assert seen["unreachable"] == 0
    assert seen["seen"] == (mode in {"serve", "web"})  # a viewer was there as well


def test_a_leak_would_be_seen() -> None:
    seen = _alone("leak")
    assert ["tcp", "00000000"] in seen["sockets"]
    assert seen["unreachable"] == 1


def test_viewers_are_told_to_be_quiet() -> None:
    assert window.viewer_environment()["RERUN_ANALYTICS"] == "0"
