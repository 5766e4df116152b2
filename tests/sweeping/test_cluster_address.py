"""What is told of a scheduler's address that is wrong, and where Dask is not installed."""

from __future__ import annotations

import socket
import subprocess
import sys

import pytest

from dcmp_hil.errors import BackendError, ConfigError, OpenError
from dcmp_hil.sweeping.cluster import DaskCluster
from dcmp_hil.sweeping.cluster_address import host_and_port
from dcmp_hil.sweeping.cluster_errors import unusable_worker
from dcmp_hil.sweeping.cluster_look import ClusterTimeouts


@pytest.mark.parametrize(
    ("address", "fault"),
    [
        ("", "is no address of a Dask scheduler"),
        ("127.0.0.1:8786", "is no address of a Dask scheduler"),
        ("http://127.0.0.1:8786", "is no address of a Dask scheduler"),
        ("inproc://1/2/3", "is no address of a Dask scheduler"),
        ("tcp://", "names no host"),
        ("tcp://10.0.0.5", "names no port"),
        ("tcp://10.0.0.5:0", "names no port"),
        ("tcp://10.0.0.5:99999", "has no valid host and port"),
        ("tcp://[::1:8786", "has no valid host and port"),
        ("tcp://10.0.0.5:8786/status", "has more than a host and a port"),
        ("tcp://anna@10.0.0.5:8786", "has more than a host and a port"),
    ],
)
def test_wrong_address_is_refused_with_the_right_form(address: str, fault: str) -> None:
    with pytest.raises(ConfigError, match=f"^--scheduler {address!r} {fault}".replace("[", r"\[")) as wrong:
        DaskCluster(address)
    assert str(wrong.value).endswith(
        "Write tcp://HOST:PORT, or tls://HOST:PORT, as `dask scheduler` prints it when it starts."
    )


def test_address_has_a_host_and_a_port() -> None:
    assert host_and_port("tcp://[::1]:8786") == ("::1", 8786)
    assert host_and_port("tls://lab.example:1/") == ("lab.example", 1)


def test_host_that_cannot_be_one_is_refused() -> None:
    pytest.importorskip("distributed")
    with pytest.raises(ConfigError, match="has no valid host"):
        DaskCluster("tcp://a..b:8786")


def test_what_listens_and_is_silent_is_no_scheduler() -> None:
    pytest.importorskip("distributed")
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = f"tcp://127.0.0.1:{listener.getsockname()[1]}"
        with pytest.raises(OpenError, match=r"does not answer as a Dask scheduler \(no answer in time\)"):
            DaskCluster(address, ClusterTimeouts(connect_s=0.3))


def test_worker_that_cannot_import_it_is_named() -> None:
    said = str(unusable_worker("tcp://10.0.0.7:1", ModuleNotFoundError("No module named 'dcmp_hil'")))
    assert said.startswith(
        "The worker tcp://10.0.0.7:1 cannot run a sweep (ModuleNotFoundError: No module named"
    )


def test_missing_dask_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(
        BackendError, match=r"distributed.* is not installed: pip install 'dcmp-hil\[cluster\]'"
    ):
        DaskCluster("tcp://127.0.0.1:8786")


def test_dask_is_imported_for_a_scheduler_only() -> None:
    code = (
        "import sys, dcmp_hil.sweeping.api, dcmp_hil.sweeping.cluster\n"
        "print([name for name in ('dask', 'distributed', 'tornado') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
