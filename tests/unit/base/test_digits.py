"""Two significant digits of a standard deviation decide the digits of its value."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fmu_models.base.digits import deviation, like_sd, places, value_with_sd

SIZES = st.floats(min_value=1e-12, max_value=1e12)


@pytest.mark.parametrize(
    ("value", "sd", "shown"),
    [
        (0.64979, 0.015, "0.650 ± 0.015"),
        (0.64979, 0.00022, "0.64979 ± 0.00022"),
        (0.3499, 0.002, "0.3499 ± 0.0020"),
        (0.1, 0.0996, "0.10 ± 0.10"),
        (12345.0, 678.0, "12340 ± 680"),
        (6.02e-7, 1.7e-6, "(0.6 ± 1.7)e-06"),
        (3.2e9, 2.34e7, "(3.200 ± 0.023)e+09"),
        (-1e-9, 1.5, "0.0 ± 1.5"),
        (2.0, 0.0, "2"),
        (2.0, None, "2"),
        (2.0, math.inf, "2 ± inf"),
    ],
)
def test_values_as_people_read_them(value, sd, shown):
    assert value_with_sd(value, sd) == shown


def test_the_unit_follows_and_that_of_a_pure_number_does_not():
    assert value_with_sd(1.0, 0.1, "s/m") == "1.00 ± 0.10 s/m"
    assert value_with_sd(1.0, 0.1, "1") == "1.00 ± 0.10"


@given(st.floats(min_value=-1e9, max_value=1e9), SIZES)
@example(0.65, 0.015)
@example(9.96, 0.0996)
def test_what_is_shown_is_the_value_to_two_digits_of_its_deviation(value, sd):
    shown = value_with_sd(value, sd)
    found = re.fullmatch(r"\(?(-?[\d.]+) ± ([\d.]+)\)?(?:e([+-]\d+))?", shown)
    assert found, shown
    power = 10.0 ** int(found[3] or 0)
    read, spread = float(found[1]) * power, float(found[2]) * power
    unit = 10.0 ** -places(sd)  # of the last digit shown
    slack = 1e-9 * (abs(value) + sd)  # binary against decimal
    assert abs(read - value) <= unit / 2 + slack
    assert abs(spread - sd) <= unit / 2 + slack
    assert 9.5 * unit <= sd + slack and sd <= 99.5 * unit + slack
    # both stop at the same digit
    assert len(found[1].partition(".")[2]) == len(found[2].partition(".")[2])


@given(SIZES)
def test_a_deviation_by_itself_is_right_to_two_digits(sd):
    assert float(deviation(sd)) == pytest.approx(sd, rel=0.0501)
    assert len(re.sub(r"e.*|\.|^0\.0*", "", deviation(sd)).lstrip("0").rstrip("0")) <= 2


def test_a_value_beside_its_deviation():
    assert like_sd(0.349876, 0.0022) == "0.3499"
    assert like_sd(0.349876, None) == like_sd(0.349876, math.nan) == "0.34988"
    # a zero has the digits of others, unless they are many
    assert [like_sd(value, 1.0) for value in (0.001, 2.0)] == ["0.0", "2.0"]
    assert [like_sd(value, 1e-7) for value in (1e-12, 0.5)] == ["0", "0.50000000"]
    assert deviation(None) == "" and deviation(0.0) == "0"
