"""Why a device cannot be used, each with its remedy; `name` is what to call the link."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.device.client import SINGLE_ANSWER_TIMEOUT_S
from dcmp_hil.errors import LinkError, OpenError, SampleTimeoutError
from dcmp_hil.platform.host_info import contention
from dcmp_hil.safety.device_faults import meaning_of, name_of
from dcmp_hil.wire.messages import ParameterResult
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Collection

    from dcmp_hil.wire.messages import ParameterValue

_ADAPTER_WAIT_MAX_S = 0.035  # two waits of an adapter's 16 ms, at most
_FIRMWARE_REMEDY = "Flash the firmware that comes with this version of dcmp-hil"


class NoAnswerError(OpenError):
    """A device was heard, and did not answer or obey: it may be the line."""


def damaged(name: str, here: int, there: int, error: OpenError) -> OpenError:
    """Make the error for a line that damages so much that the device could not be armed.

    Parameters
    ----------
    name
        What to call the link.
    here, there
        Frames that arrived damaged at this computer, and at the device.
    error
        What failed because of it.
    """
    first = str(error).removeprefix(f"{name}: ").partition(". ")[0]
    return OpenError(
        f"{name}: {first}, and the line damages frames: {here} on the way here, {there} on the way to the "
        "device. Check cable, shield, ground and termination, and the baud or bit rate."
    )


def only_damage(name: str, other_carrier: str) -> OpenError:
    """Make the error for a line on which something is heard, and no frame in it; the carrier may be told."""
    if other_carrier:
        return OpenError(f"{name}: a device answers there on another carrier. Say {other_carrier}.")
    return OpenError(
        f"{name}: something arrives, but no valid frame: all of it is damaged. Check the baud or bit rate "
        "(backend.baud, backend.bitrate), cable and ground, and that the device is set to the same carrier."
    )


def other_node(name: str, node: int, nodes: Collection[int]) -> OpenError:
    """Make the error for frames of other devices alone."""
    there = " and ".join(str(number) for number in sorted(nodes))
    return OpenError(
        f"{name}: frames arrive from node {there}, but none from node {node}. Check backend.node; `dcmp-hil "
        "ports` lists who is there."
    )


def silence(name: str, seconds: float) -> OpenError:
    """Make the error for a silent line."""
    return OpenError(
        f"{name}: nothing arrives within {seconds:g} s. Check that the device has power, that the cable is "
        "the right one, and the rate; `dcmp-hil ports` lists what answers where. A board that boots when "
        "its port is opened may need a longer backend.boot_wait_s."
    )


def deaf(name: str) -> NoAnswerError:
    """Make the error for a device that is heard and does not hear."""
    return NoAnswerError(
        f"{name}: the device sends samples but does not answer. Check the wire from host to device (TX)."
    )


def other_protocol(name: str, firmware: str, protocol: int) -> OpenError:
    """Make the error for two sides that do not speak the same."""
    return OpenError(
        f"{name}: firmware {firmware} speaks protocol {protocol:08x}, this host {PROTOCOL_HASH:08x}. "
        f"{_FIRMWARE_REMEDY}, or install the dcmp-hil that the firmware came with."
    )


def owned(name: str) -> OpenError:
    """Return the error for a device that another host owns."""
    return OpenError(
        f"{name}: another host owns the device. End its run first; what it leaves behind is given up by "
        "the device after half a second."
    )


def slow(name: str, seconds: float) -> NoAnswerError:
    """Make the error for answers that take too long; infinity for longer than was waited."""
    took = (
        f"{1e3 * seconds:.1f} ms"
        if seconds < math.inf
        else f"more than {1e3 * SINGLE_ANSWER_TIMEOUT_S:.0f} ms"
    )
    said = f"{name}: an answer takes {took}, there and back, and commands older than 3 ms are refused."
    if seconds > _ADAPTER_WAIT_MAX_S:
        return NoAnswerError(
            f"{said} No setting of an adapter makes so much: the line goes through something slow, such as a "
            "network, a radio or another program. Plug the device into this computer."
        )
    port = name.rpartition("/")[2]
    timer = f"/sys/bus/usb-serial/devices/{port if port.startswith('ttyUSB') else 'ttyUSB0'}/latency_timer"
    return NoAnswerError(f"{said} Lower the USB adapter's latency timer: echo 1 > {timer}")


def faulty(name: str, fault: str) -> OpenError:
    """Make the error for a fault that does not clear."""
    return OpenError(
        f"{name}: the device stays in fault {fault}. Look at what `dcmp-hil monitor` says, mend the "
        "cause, and switch the device off and on."
    )


def latched(name: str, code: int) -> OpenError:
    """Make the error for a fault that waits for a person."""
    meaning = meaning_of(code)
    return OpenError(
        f"{name}: the device was left in fault {name_of(code)} and keeps it. {meaning.sentence}. "
        f"{meaning.remedy} Then start once with --clear, `Session(clear=True)` in Python."
    )


def other_fault(name: str, first: str, second: str) -> OpenError:
    """Make the error for a fault that takes the place of the one that is being cleared."""
    return OpenError(
        f"{name}: the device was in fault {first}, and while that was cleared it fell into {second}. Look at "
        "what `dcmp-hil monitor` says, mend the cause, then start again."
    )


def impossible(name: str, what: str) -> OpenError:
    """Make the error for an answer that no device can mean."""
    return OpenError(
        f"{name}: the device says {what}, which cannot be. It is not used. {_FIRMWARE_REMEDY}, or mend "
        "the device's own; `dcmp-hil monitor` shows what it sends."
    )


def two_devices(name: str, node: int) -> OpenError:
    """Make the error for a node that is there twice."""
    return OpenError(
        f"{name}: two devices send as node {node}: their ticks jump forth and back. Unplug one, or build its "
        "firmware with another node (backend.node then says which of them to run)."
    )


def no_samples(name: str, seconds: float, heard: str) -> OpenError:
    """Make the error for a device that sends all but samples."""
    return OpenError(
        f"{name}: {heard} arrives, but no SAMPLE within {seconds:g} s. The line is right; the device's "
        f"periodic tick does not run, or its samples find no room. {_FIRMWARE_REMEDY}."
    )


def not_taken(name: str, parameter: str, value: int, answer: ParameterValue | None) -> NoAnswerError:
    """Make the error for a parameter that stays as it was."""
    why = "no answer" if answer is None else f"it stays at {answer.value}, {_result(answer.result)}"
    return NoAnswerError(
        f"{name}: the device does not take {parameter} = {value} ({why}). Use what it allows, build the "
        "firmware with a higher limit, or start again if another host was there a moment ago."
    )


def not_kept(name: str, parameter: str, value: int, kept: int) -> OpenError:
    """Refuse a device that says another limit than it has just taken."""
    return OpenError(
        f"{name}: {parameter} was set to {value}, and reads {kept} a moment later. The limits of a run "
        "have to hold in the device: look for a second host on the line, or for firmware of another make."
    )


def _result(result: int) -> str:
    return ParameterResult(result).name if result in set(ParameterResult) else f"result {result}"


def not_told(name: str, parameter: str) -> NoAnswerError:
    """Make the error for a parameter that is not there."""
    return NoAnswerError(f"{name}: the device does not say its {parameter}. {_FIRMWARE_REMEDY}.")


def not_armed(name: str, state: str, seconds: float) -> NoAnswerError:
    """Make the error for a device that does not get to RUN."""
    return NoAnswerError(
        f"{name}: the device did not arm within {1e3 * seconds:.0f} ms and is in {state}. Commands may "
        "arrive too late (a slow adapter, a busy computer); `dcmp-hil monitor` shows what it counts."
    )


def no_sample(name: str, seconds: float, damaged: int, stale: int) -> SampleTimeoutError:
    """Make the error for a device that is not heard any more; `damaged` and `stale` frames came meanwhile."""
    said = f"{name}: no sample for {1e3 * seconds:.0f} ms"
    zero = "The device's watchdog has taken the amplifier to 0 V."
    if damaged:
        return SampleTimeoutError(
            f"{said}: all that arrived was damaged ({damaged} frames). {zero} Check cable, shield, ground "
            "and termination, and the baud or bit rate, then start again."
        )
    if stale:
        return SampleTimeoutError(
            f"{said} that is new: {stale} came, with ticks that were there before. {zero} The device's clock "
            "stands still, or two devices have one node; look at `dcmp-hil monitor`."
        )
    if busy := contention():
        return SampleTimeoutError(
            f"{said}, and this computer is busy: {busy}. {zero} End other programs, or give the run "
            "real-time priority (docs/cli.md), then start again. If it comes back, check cable and "
            "power of the device."
        )
    return SampleTimeoutError(f"{said}. {zero} Check cable and power of the device, then start again.")


def stood_still(name: str, seconds: float) -> LinkError:
    """Make the error for a computer that slept through the device's watchdog."""
    return LinkError(
        f"{name}: this computer stood still for {seconds:.2f} s. The device's watchdog has taken the "
        "amplifier to 0 V. Start again."
    )


def taken_over(name: str) -> LinkError:
    """Make the error for a device that runs on the commands of another host."""
    return LinkError(
        f"{name}: the device runs, and not on this host's commands: it was not heard of for too long, and "
        "another host has it now. End one of the two."
    )


def not_confirmed(name: str, ttl_ms: int) -> LinkError:
    """Make the error for a device whose 0 V was not seen."""
    return LinkError(
        f"{name}: the device did not confirm 0 V. Its watchdog acts after {ttl_ms} ms without a command; "
        "look at the amplifier before you touch the arm."
    )
