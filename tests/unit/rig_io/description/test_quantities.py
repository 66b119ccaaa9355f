"""Quantities and calibrations of instruments as people write them."""

from __future__ import annotations

import pytest

from fmu_models.base.errors import StickslipError
from rig_io.description import quantities

QUANTITIES = {
    "0.0548±0.0003": (0.0548, 0.0003),
    "0.0548 ± 0.0003 kg m²": (0.0548, 0.0003),
    "548 ± 3 kg*cm^2": (0.0548, 0.0003),
    "0,0548 +- 0,0003": (0.0548, 0.0003),
    "0.0548(3)": (0.0548, 0.0003),
    "0.0548 ± 0.5 %": (0.0548, 0.000274),
    "5.48e-2(3) kg.m2": (0.0548, 0.0003),
    "0.0548": (0.0548, None),
    "0.0548 ± unknown": (0.0548, None),
    "unknown": (None, None),
    "unbekannt": (None, None),
}


@pytest.mark.parametrize(("text", "expected"), QUANTITIES.items())
def test_quantities_as_people_write_them(text: str, expected: tuple[float | None, float | None]) -> None:
    found = quantities.quantity(text, "kg*m^2", "J")
    for one, true in zip((found.value, found.deviation), expected, strict=True):
        assert one == (None if true is None else pytest.approx(true, rel=1e-12))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a lot", "no number"),
        ("3 N", "cannot be converted"),
        ("3 ± -1", "an uncertainty of -1"),
        ("3 blink", "unknown unit"),
    ],
)
def test_what_is_no_quantity_is_named(text: str, message: str) -> None:
    with pytest.raises(StickslipError, match=rf"J.*{message}"):
        quantities.quantity(text, "kg*m^2", "J")


def test_instruments_as_people_write_them() -> None:
    assert quantities.laser("0.01 ± 0.00002 m/V, 5 V", "laser") == {
        "gain": 0.01,
        "gain_deviation": pytest.approx(0.002),
        "zero": 5.0,
    }
    assert quantities.laser("10 mm/V at 4,98 V", "laser")["zero"] == 4.98
    assert quantities.laser("-10 mm/V, unknown", "laser") == {"gain": -0.01, "gain_deviation": None, "zero": None}
    assert quantities.encoder("1000 x4", "encoder") == {"pulses_per_revolution": 1000, "quadrature": True}
    assert quantities.encoder("512, 16 bit", "encoder")["counter_bits"] == 16
    assert quantities.laser("1 m/V", "laser")["gain"] == 1.0
    with pytest.raises(StickslipError, match="a gain of zero measures nothing"):
        quantities.laser("0 m/V, 5 V", "laser")
    for wrong in ("0", "1000.5", "many"):
        with pytest.raises(StickslipError, match="is no encoder"):
            quantities.encoder(wrong, "encoder")
