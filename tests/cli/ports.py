"""What the tests of `dcmp-hil ports` and `monitor` share: a SAMPLE, and the options that lead to a port."""

from __future__ import annotations

from dcmp_hil.wire.messages import SampleReport, State

SAMPLE = SampleReport(0, 0, 7, State.IDLE, missed=True, limited=False, fault_class=0)


def way_to(path: str, carrier: str) -> list[str]:
    where = {
        "cobs": ("backend.kind=serial", f"backend.port={path}"),
        "slcan": ("backend.kind=can", "backend.interface=slcan", f"backend.channel={path}"),
    }
    rig = {"cobs": "bench-serial", "slcan": "bench-can"}
    return [rig[carrier], *(word for key in where[carrier] for word in ("--set", key))]
