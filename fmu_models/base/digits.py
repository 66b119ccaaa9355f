"""How many digits a measured number deserves: two significant digits of its standard deviation decide, everywhere."""

import math

SIGNIFICANT = 2  # digits of a standard deviation
LEAST, MOST = 1e-5, 1e6  # between these numbers are written without an exponent
UNCERTAIN = ".5g"  # where no deviation says how many digits are known


def places(sd: float) -> int:
    """Decimal places that a standard deviation (positive, finite) deserves; negative: tens, hundreds."""
    return SIGNIFICANT - 1 - _exponent(float(f"{sd:.{SIGNIFICANT - 1}e}"))


def with_places(value: float, places: int) -> str:
    """A number rounded to decimal places, with an exponent where it is tiny or huge."""
    rounded = round(value, places)
    if rounded and not LEAST <= abs(rounded) < MOST:
        return f"{rounded:.{max(_exponent(rounded) + places, 0)}e}"
    if not rounded and 10.0**-places < LEAST:
        return "0"
    return f"{rounded + 0.0:.{max(places, 0)}f}"  # + 0.0: no minus before a zero


def deviation(sd: float | None) -> str:
    """A standard deviation by itself; nothing where there is none."""
    if sd is None:
        return ""
    return with_places(sd, places(sd)) if sd > 0 and math.isfinite(sd) else f"{sd:g}"


def like_sd(value: float, sd: float | None) -> str:
    """A value, to the digits that its standard deviation leaves; five where there is none."""
    if sd is None or not (sd > 0 and math.isfinite(sd) and math.isfinite(value)):
        return f"{value:{UNCERTAIN}}"
    return with_places(value, places(sd))


def value_with_sd(value: float, sd: float | None, unit: str = "") -> str:
    """A value and its standard deviation in the same unit: "0.6498 ± 0.0036", "(0.6 ± 1.7)e-06 s"."""
    after = f" {unit}" if unit not in ("", "1") else ""
    if sd is None or sd == 0:
        return like_sd(value, None) + after
    if not (sd > 0 and math.isfinite(sd) and math.isfinite(value)):
        return f"{like_sd(value, None)} ± {sd:g}{after}"
    largest = max(abs(value), sd)
    if LEAST <= largest < MOST:
        decimals = places(sd)
        return f"{_plain(value, decimals)} ± {_plain(sd, decimals)}{after}"
    power = _exponent(largest)
    decimals = places(sd) + power
    return f"({_plain(value / 10.0**power, decimals)} ± {_plain(sd / 10.0**power, decimals)})e{power:+03d}{after}"


def _plain(value: float, decimals: int) -> str:
    return f"{round(value, decimals) + 0.0:.{max(decimals, 0)}f}"


def _exponent(value: float) -> int:
    return int(f"{abs(value):e}".partition("e")[2])
