"""Units as people write them: read by a grammar, whatever is written there."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_models.base.errors import StickslipError
from fmu_models.base.toml_document import converted
from fmu_models.base.unit_names import BaseUnits, parse_unit
from fmu_models.base.unit_names import conversion as column_conversion
from fmu_models.coupling.wiring import conversion

# names with what they are in SI, and that they are no others
SIZES = {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "s": 1.0, "min": 60.0, "kg": 1.0, "N": 1.0, "kN": 1e3, "rad": 1.0}
EXPONENTS = {"": 1, "2": 2, "^2": 2, "**2": 2, "-1": -1, "^-1": -1, "**(-2)": -2, "^(1/2)": 0.5, "1.5": 1.5}


@given(st.text(alphabet="mskNgrad0123459.*^/()+-·µ°% _[]'\"\\\n", max_size=40))
@settings(max_examples=500, deadline=None)
def test_any_text_is_a_unit_or_said_to_be_none(text: str) -> None:
    try:
        size = abs(parse_unit(text).to_base_units().magnitude)
    except ValueError as error:
        assert str(error)
    else:
        assert 0.0 < size < math.inf


@given(
    st.lists(
        st.tuples(st.sampled_from(sorted(SIZES)), st.sampled_from(sorted(EXPONENTS)), st.sampled_from([" ", "*", "/"])),
        min_size=1,
        max_size=6,
    )
)
@settings(deadline=None)
def test_factors_are_taken_from_left_to_right(factors: list[tuple[str, str, str]]) -> None:
    text, size = "1", 1.0
    for name, exponent, mark in factors:
        text += mark + name + exponent
        size *= SIZES[name] ** (EXPONENTS[exponent] * (-1 if mark == "/" else 1))
    assert parse_unit(text).to_base_units().magnitude == pytest.approx(size, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("N m/rad s", "N*m*s/rad"),
        ("kg.m2", "kg m^2"),
        ("m.s-2", "m/s/s"),
        ("m/(s rad)", "m / s / rad"),
        ("N/m1.5", "N m^(-3/2)"),
        ("°", "deg"),
        ("U/min", "turn/min"),
    ],
)
def test_one_unit_may_be_written_in_many_ways(text: str, same: str) -> None:
    assert parse_unit(text) == parse_unit(same)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("9**9**9", "'9' where a name belongs"),
        ("m**9**9", "'**' where a name belongs"),
        ("mm(", "has nothing where a name belongs"),
        ("mm/0", "'0' where a name belongs"),
        ("(m", "a bracket of the unit '(m' is not closed"),
        ("m)", "')' is out of place"),
        ("((((((((((m))))))))))", "more than 8 brackets in brackets"),
        ("m^99", "the exponent 99 of the unit 'm^99' is larger than 12"),
        ("m^(1/0)", "is divided by zero"),
        ("m^x", "is no number"),
        ("Ym12 Ym12 Ym12", "beyond the range of numbers"),
        ("__import__", "'__import__' is not a unit"),
        ("m;s", "';' has no meaning"),
        ("degC^2", "multiplies one whose zero is not that of its base"),
        ("m" * 101, "at most 100 characters"),
        ("", "write 1 for a pure number"),
    ],
)
def test_what_is_no_unit_is_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=r"^.*$") as refused:
        parse_unit(text)
    assert message in str(refused.value)
    if text:
        for ask in (lambda: converted(f"1 {text}", "mm", "length"), lambda: column_conversion(text, "mm", "column")):
            with pytest.raises(StickslipError, match=r"length|column"):
                ask()
    with pytest.raises(ValueError, match=r"a unit is not understood|measure different"):
        conversion(text, "m")


def test_base_units_are_kept_and_then_read_without_pint(tmp_path: Path) -> None:
    units = ["N m/rad", "kg.m2", "1/min", "N/m1.5", "1", "mm"]
    code = (
        "import sys; from fmu_models.base.unit_names import base_units, conversion\n"
        "from fmu_models.base.errors import StickslipError\n"
        f"found = [base_units(unit) for unit in {units!r}]\n"
        "try: conversion('V', 'm', 'here')\n"
        "except StickslipError as error: assert 'cannot be converted to m' in str(error)\n"
        "else: assert False\n"
        "print(found, conversion('mm', 'm', '') == 1e-3, 'pint' in sys.modules)"
    )
    environment = {**os.environ, "STICKSLIP_CACHE": str(tmp_path)}

    def told() -> str:
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        return done.stdout

    bases: list[Any] = [parse_unit(unit).to_base_units() for unit in units]
    found = [BaseUnits(float(b.magnitude), tuple((str(name), power) for name, power in b.unit_items())) for b in bases]
    assert told() == f"{found} True True\n"
    assert told() == f"{found} True False\n"
    # one that is damaged is made again
    for file in (tmp_path / "units").glob("*.json"):
        file.write_text("[2.0, []]")
    assert told() == f"{found} True True\n"
    # and where nothing can be kept it is the same
    environment["STICKSLIP_CACHE"] = os.devnull
    assert told() == f"{found} True True\n"


def test_a_number_above_another_zero_is_no_multiple() -> None:
    with pytest.raises(StickslipError, match=r'label = "20 degC" cannot be converted to K'):
        converted("20 degC", "K", "label")
    with pytest.raises(StickslipError, match="is in 'degC', which cannot be converted to K"):
        column_conversion("degC", "K", "the column")
    assert converted("20 K", "K", "label") == 20.0
