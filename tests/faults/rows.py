"""The matrix's rows: what goes wrong, and what is right to happen then; diagnoses are judged here alone."""

from __future__ import annotations

from typing import NamedTuple

FINE = frozenset({"completed"})
SILENT = frozenset({"HOST_SILENT", "SampleTimeoutError"})
"""The error of the side that sees it first."""
NUMBER = frozenset({"not_finite"})
PUSHED = frozenset({"disturbance", "speed", "OVER_SPEED"})
JUMPED = frozenset({"speed", "jump", "ENCODER_JUMP", "disturbance"})
MOTOR_OFF, ENCODER_OFF = frozenset({"power"}), frozenset({"stuck"})
REVERSED = frozenset({"polarity"})
NOT_OPENED = frozenset({"OpenError"})
STOOD_STILL = frozenset({"HOST_SILENT", "LinkError"})

_WATCHDOG_MS = 21.0
_DETECTED_MS = 600.0


class Row(NamedTuple):
    """One kind of fault, or one variant of it."""

    fault: str  # as on the command line; `at` is drawn unless it is given
    right: frozenset[str] = FINE  # outcomes; see `outcome_of`
    bound_ms: float | None = None  # from the fault to 0 V; None where the run goes on
    most_rad: float = 1.3  # of the plant's |x|
    most_rad_s: float = 6.0  # of its |x'|
    settled_mrad: float | None = 5.0  # of tracking in the last 0.1 s of a run that completes
    overrides: tuple[str, ...] = ()
    rearms: bool = True  # afterwards a healthy run starts and follows
    open: str = ""  # what the product does not do yet: such a row is counted and shown, and fails nothing

    @property
    def name(self) -> str:
        """Name of the row in the table."""
        return " ".join((self.fault, *self.overrides))


def _at_once(fault: str, right: frozenset[str], bound_ms: float = 2.0, **more: float) -> Row:
    return Row(fault, right, bound_ms, **more)  # type: ignore[arg-type]


def _silent(fault: str, right: frozenset[str] = SILENT) -> Row:
    return Row(fault, right, _WATCHDOG_MS)


WIRE = (
    Row("wire.drop:p=0.02,way=up,for=0.5s"),
    Row("wire.drop:p=0.2,for=0.5s"),
    Row("wire.drop:p=0.02,burst=5,way=up,for=0.5s"),
    Row("wire.drop:p=0.02,burst=5,way=down,for=0.5s"),
    Row("wire.drop:p=1,way=up,for=19ms"),
    _silent("wire.drop:p=1,burst=25,way=up,for=25ms"),
    Row("wire.drop:p=1,way=down,for=9ms"),
    _silent("wire.drop:p=1,burst=25,way=down,for=25ms"),
    Row("wire.dup:p=0.5"),
    Row("wire.delay:ms=1,way=up,for=0.5s"),
    Row("wire.delay:ms=1,way=down,for=0.5s"),
    _silent("wire.delay:ms=5,way=up"),
    _silent("wire.delay:ms=10,way=down"),
    _silent("wire.delay:ms=500"),
    Row("wire.reorder:p=0.2,depth=2,for=0.5s"),
    Row("wire.reorder:p=0.1,depth=100,for=0.5s"),
    Row("wire.flip:p=0.015,bits=1,for=0.5s"),
    Row("wire.flip:p=0.015,bits=2,for=0.5s"),
    Row("wire.flip:p=0.015,bits=3,for=0.5s"),
    Row("wire.flip:p=0.3,bits=1,way=down,for=0.5s"),
    Row("wire.flip:p=0.4,bits=1,way=up", frozenset({"CORRUPT_LINK"}), 100.0),
    Row("wire.noise:rate=0.0001,for=0.5s"),
    Row("wire.noise:rate=0.01,way=up", frozenset({"CORRUPT_LINK", "HOST_SILENT"}), 100.0),
    Row("wire.garbage:p=0.015,bytes=8,for=0.5s"),
    Row("wire.truncate:p=0.015,bytes=1,for=0.5s"),
    Row("wire.truncate:p=0.015,bytes=6,for=0.5s"),
    Row("wire.insert:p=0.01,bytes=3,for=0.5s"),
    _silent("wire.garble", SILENT | {"CORRUPT_LINK"}),
    Row("wire.garble:at=boot", NOT_OPENED),
    _silent("wire.hold:ms=200,way=up"),
    _silent("wire.hold:ms=200,way=down"),
    _silent("wire.hold:ms=200"),
    Row("wire.hold:ms=15"),
    _silent("wire.blackhole"),
    _silent("wire.blackhole:way=up"),
    _silent("wire.blackhole:way=down"),
    _at_once("wire.unplug", frozenset({"LINK_DOWN", "SampleTimeoutError"})),
    _at_once("wire.unplug:for=10ms", frozenset({"LINK_DOWN"})),
)
FIRMWARE = (
    _at_once("firmware.reset", frozenset({"DISARMED"})),
    _at_once("firmware.stop", frozenset({"STOPPED"})),
    Row("firmware.hello:times=100"),
    Row("firmware.drive:times=100"),
    Row("firmware.hello:times=1e6,at=boot", NOT_OPENED, rearms=False),
    Row("firmware.version:at=boot", NOT_OPENED),
    Row("firmware.clock:percent=2"),
    Row("firmware.clock:percent=-2"),
    Row("firmware.start:us=4293467296,at=boot"),
    Row("firmware.start:tick=2147482248,at=boot"),
    Row("firmware.start:tick=4294966096,at=boot"),
    Row("firmware.start:count=32700,at=boot"),
    Row("firmware.start:count=8388500,at=boot"),
    Row("firmware.start:count=2147483500,at=boot"),
)
_TURNING = ("reference.rate_rad_s=2.0",)  # the reference turns round while the fault comes
PLANT = (
    Row("plant.enc_stuck", ENCODER_OFF, _DETECTED_MS, 3.0, 8.0),
    Row("plant.enc_glitch:counts=10"),
    Row("plant.enc_glitch:counts=50"),
    Row("plant.enc_glitch:counts=100"),
    Row("plant.enc_glitch:counts=200"),
    Row("plant.enc_glitch:counts=1000"),
    Row("plant.enc_glitch:counts=-1e6"),
    Row("plant.enc_glitch:counts=1000,times=3,every=5", JUMPED, 20.0),
    Row("plant.enc_jump:counts=1000,times=3", JUMPED, 20.0),
    Row("plant.enc_noise:counts=1,for=0.5s"),
    Row("plant.enc_noise:counts=3,for=0.5s", settled_mrad=10.0),
    Row("plant.enc_missed:p=0.02", settled_mrad=None),
    Row("plant.enc_sign", REVERSED, 300.0, 2.0, 3.0),
    Row("plant.enc_sign:at=boot", REVERSED, 600.0, 0.1, 3.0),
    Row("plant.motor_sign", REVERSED, 300.0, 2.0, 3.0),
    Row("plant.motor_sign:at=boot", REVERSED, 600.0, 0.1, 3.0),
    Row("plant.power", MOTOR_OFF, _DETECTED_MS, 2.0, 8.0),
    Row("plant.enc_stuck", ENCODER_OFF, _DETECTED_MS, 3.0, 8.0, overrides=_TURNING),
    Row("plant.motor_sign", REVERSED, 300.0, 2.0, 5.0, overrides=_TURNING),  # 2 rad/s are asked for
    Row("plant.power", MOTOR_OFF, _DETECTED_MS, 2.0, 8.0, overrides=_TURNING),
    Row("plant.power:at=boot", MOTOR_OFF, 600.0, 0.2, 3.0),
    Row("plant.gain:factor=0.6"),
    Row("plant.gain:factor=1.5"),
    Row("plant.saturation:V=5"),
    Row("plant.saturation:V=0.3", PUSHED | {"saturation", "power"}, _DETECTED_MS),
    Row("plant.offset:V=1"),
    Row("plant.offset:V=-1"),
    Row("plant.dead_band:V=0.3", settled_mrad=10.0),
    Row("plant.shove:rad_s2=30,for=100ms"),
    Row(
        "plant.shove:rad_s2=100,for=100ms",
        PUSHED,
        bound_ms=100.0,
        most_rad=6.0,
        most_rad_s=15.0,
        rearms=False,  # it may hang on the other side of the top
    ),
    Row("plant.push:rad_s2=15"),
    Row("plant.sway:rad_s2=8,hz=0.3,for=1s"),
    Row("plant.square:rad_s2=3,hz=0.4,for=1s"),
    Row("plant.delay:periods=2"),
    Row("plant.cpr:factor=4,at=boot", frozenset({"gain"}), 600.0),
    Row("plant.cpr:factor=0.2,at=boot", frozenset({"gain"}), 600.0),
    Row("plant.cpr:factor=0.25,at=boot", frozenset({"gain", "power"}), 600.0),
)
_SLOW = ("timing.overrun=stop",)
HOST = (
    *(
        _at_once(f"host.spoil:where={where}", NUMBER)
        for where in (
            *("sample.position", "sample.voltage", "sample.t", "demand"),
            *("estimate.position", "estimate.velocity", "estimate.disturbance"),
        )
    ),
    _at_once("host.spoil:where=demand,value=inf", NUMBER),
    _at_once("host.spoil:where=sample.position,value=-inf", NUMBER),
    _at_once("host.spoil:where=sample.t,value=inf", NUMBER),
    _at_once("host.raise:where=controller", frozenset({"InjectedError"})),
    _at_once("host.raise:where=controller,what=base", frozenset({"InjectedBaseError"})),
    _at_once("host.raise:where=observer", frozenset({"InjectedError"})),
    _at_once("host.raise:where=observer,what=base", frozenset({"InjectedBaseError"})),
    Row("host.diverge:factor=2", PUSHED | NUMBER, 20.0),
    Row("host.chatter", frozenset({"chatter"}), 700.0),  # ten blocks of 50 ms, then 50 ms to 0 V
    Row("host.chatter:V=3,every=2", frozenset({"chatter"}), 700.0),
    Row("host.delay:ms=3"),
    Row("host.delay:ms=15"),
    _silent("host.delay:ms=50", STOOD_STILL),
    _silent("host.delay:ms=400", STOOD_STILL),
    Row("host.slow:ms=1,p=0.05,for=0.5s"),
    Row("host.slow:ms=2,for=0.5s", settled_mrad=10.0),
    Row("host.slow:ms=2", frozenset({"DeadlineError"}), 80.0, overrides=_SLOW),  # 5 of 20, then 50 ms
    _silent("host.slow:ms=25"),
    Row("host.pauses:ms=20,more=14,p=0.05", STOOD_STILL, 400.0),
)
ROWS = (*WIRE, *FIRMWARE, *PLANT, *HOST)
PLAIN = tuple(
    row for row in ROWS if row.fault.startswith(("plant.", "host.spoil", "host.raise", "host.diverge"))
)
"""What can happen to the plain simulated rig with the same end."""
