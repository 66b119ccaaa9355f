"""The standard deviation of a calibrated value that its logs tell."""

from __future__ import annotations

from identification.calibration.result import CalibratedValue


def deviation(value: CalibratedValue) -> float:
    assert value.standard_deviation is not None
    return value.standard_deviation
