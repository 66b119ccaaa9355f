"""A short bench, emulated: two drive speeds, 6 s each, with or without micro-slip."""

from __future__ import annotations

from identification.measurement.pooled import Pool
from identification.measurement.pooling import pool
from rig_io.bench.emulation import MicroSlip
from rig_io.bench.emulator import emulate, standard_set


def bench(micro_slip: MicroSlip | None) -> Pool:
    settings = standard_set(speeds=(0.83, 1.4), duration=6.0, micro_slip=micro_slip)[:2]
    return pool([emulate(one, 5, number) for number, one in enumerate(settings)])
