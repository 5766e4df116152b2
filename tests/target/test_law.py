"""The law in single precision on the Cortex-M4: no library, and the bits that this computer has."""

from __future__ import annotations

import ctypes
import subprocess
from typing import TYPE_CHECKING, Any

import numpy as np
import unicorn
from unicorn import arm_const as arm

from dcmp_hil.control.observers.super_twisting import tune
from dcmp_hil.control.predictor import held_input
from tests.firmware.core_library import CORE, LAW, WARNINGS
from tests.firmware.law import T, context, reference, ride
from tests.target.build import needed

if TYPE_CHECKING:
    from pathlib import Path

_EMULATOR: Any = unicorn  # its stubs leave names out
SINGLE = ["-DDCMP_REAL_FLOAT", "-Wdouble-promotion", f"-I{CORE}"]
M4 = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
PERIODS = 2000
WIDTH = 10  # numbers of a sample and its results: y, V, xr, vr, ar; then estimate, voltage, periods
LOOP = """
#include "dcmp_control.h"
struct rig {
    struct dcmp_tuning tuning;
    struct dcmp_step step;
    struct dcmp_predictor predictor;
    struct dcmp_pd pd;
    struct dcmp_step_lengths lengths;
};
void run(const struct rig *rig, float *rows, uint32_t n);
void run(const struct rig *rig, float *rows, uint32_t n)
{
    struct dcmp_super_twisting state = dcmp_super_twisting_restart(rows[0]);
    for (uint32_t i = 0; i < n; i++) {
        float *row = &rows[10u * i];
        const float friction = dcmp_known_friction(1.3f, row[3]);
        const float told = dcmp_told_voltage(row[1], friction, rig->pd.volts);
        state = dcmp_super_twisting_update(state, rig->tuning, rig->step, rig->lengths.period, row[0], told);
        const struct dcmp_estimate rest = dcmp_super_twisting_estimate(state, rig->tuning);
        const struct dcmp_estimate whole = dcmp_whole_estimate(rest, friction);
        const struct dcmp_reference reference = {row[2], row[3], row[4]};
        row[5] = whole.position;
        row[6] = whole.velocity;
        row[7] = whole.disturbance;
        row[8] = dcmp_pd_voltage(rig->pd, reference, dcmp_ahead(whole, rig->predictor, row[1]));
        row[9] = (float)dcmp_step_periods(rig->lengths.period * row[0], rig->lengths);
    }
}
"""
FILTER = """
#include "dcmp_friction_kalman.h"
void filter(struct dcmp_friction_kalman *state, const struct dcmp_friction_setup *setup,
            const float *x, float *out);
void filter(struct dcmp_friction_kalman *state, const struct dcmp_friction_setup *setup,
            const float *x, float *out)
{
    const struct dcmp_friction_times times = {x[0], x[6]};
    *state = dcmp_friction_kalman_update(*state, *setup, times, x[1], x[2]);
    const struct dcmp_estimate estimate = dcmp_friction_ahead(*state, *setup, true, x[3], x[4], x[5]);
    out[0] = estimate.position;
    out[1] = estimate.velocity;
    out[2] = estimate.disturbance;
}
"""


def _compiled(folder: Path, text: str, *options: str) -> Path:
    (folder / "law.c").write_text(text)
    built = folder / "law.o"
    command = [
        needed("arm-none-eabi-gcc"),
        *WARNINGS,
        *LAW,
        *SINGLE,
        *M4,
        *options,
        "-c",
        "law.c",
        "-o",
        str(built),
    ]
    subprocess.run(command, cwd=folder, check=True)
    return built


def _symbols(built: Path, *options: str) -> list[list[str]]:
    command = [needed("arm-none-eabi-nm"), *options, str(built)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return [line.split() for line in done.stdout.splitlines()]


def test_nothing_is_left_to_a_library(tmp_path: Path) -> None:
    assert _symbols(_compiled(tmp_path, LOOP, "-O2"), "--undefined-only") == []
    wanted = {name for *_, name in _symbols(_compiled(tmp_path, FILTER, "-O2"), "--undefined-only")}
    assert wanted <= {"memcpy", "memset"}  # of assignments; startup.c has them


def _rig() -> Any:
    """Return the numbers of struct rig."""
    rig = context()
    tuning, model = tune(rig, L1=4.9, L2=5.51, M=None, mu0=None), rig.model
    cube = tuning.mu0 * tuning.mu0 * tuning.mu0
    numbers = [model.ku, 4.9, 5.51 + model.f0 * 4.9, 4.9 + model.f0, tuning.M, tuning.mu0, tuning.M / cube]
    numbers += [*tuning.nominal, *held_input(model.f0, T), model.ku]
    numbers += [4000.0, 130.0, 1.0, model.f0, 1.0 / model.ku, T, 0.02 * T]
    return np.array(numbers, np.float32)


def _rows() -> Any:
    rows = np.zeros((PERIODS, WIDTH), np.float32)
    for row, sample in zip(rows, ride(periods=PERIODS), strict=True):
        row[:5] = sample.position, sample.voltage, *reference(sample.t)
    return rows


def _on_the_chip(folder: Path, rig: Any, rows: Any) -> Any:
    """Run the loop in unicorn's Cortex-M4."""
    flash, ram, end = 0x0800_0000, 0x2000_0000, 0x0801_0000
    linked, image = folder / "law.elf", folder / "law.bin"
    flags = ["-nostdlib", f"-Wl,-Ttext={flash:#x}", "-Wl,-e,run"]
    command = [
        needed("arm-none-eabi-gcc"),
        *M4,
        *flags,
        str(_compiled(folder, LOOP, "-O2")),
        "-o",
        str(linked),
    ]
    subprocess.run(command, check=True)
    subprocess.run(
        [needed("arm-none-eabi-gcc").replace("gcc", "objcopy"), "-O", "binary", str(linked), str(image)],
        check=True,
    )
    entry = next(int(line[0], 16) for line in _symbols(linked) if line[-1] == "run")
    uc: Any = _EMULATOR.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS)
    uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
    uc.mem_map(flash, 0x2_0000)
    uc.mem_map(ram, 0x4_0000)
    uc.mem_write(flash, image.read_bytes())
    uc.mem_write(ram, rig.tobytes())
    uc.mem_write(ram + 0x1000, rows.tobytes())
    uc.reg_write(arm.UC_ARM_REG_SP, ram + 0x4_0000)
    uc.reg_write(arm.UC_ARM_REG_LR, end | 1)
    for register, value in enumerate((ram, ram + 0x1000, len(rows))):
        uc.reg_write(arm.UC_ARM_REG_R0 + register, value)
    uc.emu_start(entry | 1, end)
    return np.frombuffer(bytes(uc.mem_read(ram + 0x1000, rows.nbytes)), np.float32).reshape(rows.shape)


def _here(folder: Path, rig: Any, rows: Any) -> Any:
    (folder / "law.c").write_text(LOOP)
    command = [needed("gcc"), *WARNINGS, *LAW, *SINGLE, "-O2", "-fPIC", "-shared", "law.c", "-o", "law.so"]
    subprocess.run(command, cwd=folder, check=True)
    found = rows.copy()
    ctypes.CDLL(str(folder / "law.so")).run(
        ctypes.c_void_p(rig.ctypes.data), ctypes.c_void_p(found.ctypes.data), len(found)
    )
    return found


def test_a_ride_on_the_chip_has_the_bits_of_this_computer(tmp_path: Path) -> None:
    rig, rows = _rig(), _rows()
    on_the_chip, here = _on_the_chip(tmp_path, rig, rows), _here(tmp_path, rig, rows)
    assert np.isfinite(here).all()
    assert np.ptp(here[:, 5:9], axis=0).min() > 0.1
    assert np.array_equal(on_the_chip.view(np.int32), here.view(np.int32))
