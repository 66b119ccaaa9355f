"""A TOML file whose faults can be named by their line."""

from __future__ import annotations

import difflib
import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.trust import admit

_HEADER = re.compile(r"\s*(\[\[?)\s*([^\]]+?)\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(r"""\s*((?:[\w-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[\w-]+|"[^"]*"|'[^']*'))*)\s*=""")
_RANGE = {"from", "to", "count"}
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*$")


class Document:
    """A parsed file; a place in it is the sequence of its keys. trust: the user trusts the code that it names.

    Raises:
        StickslipError: it cannot be read, or is not TOML.
    """

    def __init__(self, path: Path, text: str, *, trust: bool = False) -> None:
        self.path, self.trust = path, trust
        self._text = text
        try:
            self.data: dict[str, Any] = tomllib.loads(text)
        except (tomllib.TOMLDecodeError, RecursionError) as error:
            raise StickslipError(f"{path} is not TOML: {error}.") from error
        self._lines = _index(text)

    def line(self, *place: str | int) -> int | None:
        """Line of a key, or of the nearest table around it; from 1."""
        for length in range(len(place), 0, -1):
            if found := self._lines.get(place[:length]):
                for part in place[length:]:
                    found = self._inside(found, part)
                return found
        return None

    def _inside(self, begin: int, part: str | int) -> int:
        """Line of a word, or of a table by its number, in a value that begins in a line: values may take several."""
        pattern = re.compile(rf"\b{re.escape(part)}\b" if isinstance(part, str) else r"\{")
        before = part if isinstance(part, int) else 0
        for number, text in enumerate(self._text.splitlines()[begin - 1 :], begin):
            if number > begin and (_HEADER.match(text) or _KEY.match(text)):
                break
            before -= len(pattern.findall(text))
            if before < 0:
                return number
        return begin

    def fault(self, message: str, *place: str | int) -> StickslipError:
        """The error to raise for what stands at a place."""
        number = self.line(*place)
        return StickslipError(f"{self.path}, line {number}: {message}" if number else f"{self.path}: {message}")

    def check_keys(self, known: Iterable[str], *place: str | int) -> None:
        """Refuse keys of a table that nobody reads.

        Raises:
            StickslipError: which, and the nearest known one.
        """
        choices = list(known)
        for key in self.table(*place):
            if key not in choices:
                where = (
                    f"in [{'.'.join(p for p in place if isinstance(p, str))}]" if place else "at the top of the file"
                )
                raise self.fault(f"'{key}' is not a key {where}.{nearest(key, choices)}", *place, key)

    def table(self, *place: str | int) -> dict[str, Any]:
        """The table at a place, empty if there is none."""
        found: Any = self.data
        for key in place:
            found = found.get(key, {}) if isinstance(found, dict) else found[key]
        if not isinstance(found, dict):
            raise self.fault(f"'{place[-1]}' must be a table of names and values, found {found!r}.", *place)
        return found

    def entries(self, key: str) -> list[dict[str, Any]]:
        """The tables of a list, none if it is left out."""
        found = self.data.get(key, [])
        if not isinstance(found, list):
            raise self.fault(f"'{key}' must be tables, each written as [[{key}]], in double brackets.", key)
        for i, entry in enumerate(found):
            if not isinstance(entry, dict):
                raise self.fault(f"'{key}' must be tables, {{ name = value }}; number {i + 1} is {entry!r}.", key, i)
        return found

    def text(self, key: str, *place: str | int, default: str | None = None) -> str:
        """A text."""
        found = self.table(*place).get(key, default)
        if found is None:
            raise self.fault(f"'{key}' is missing. Add it: {key} = \"...\"", *place)
        if not isinstance(found, str):
            raise self.fault(f"'{key}' must be a text in quotation marks, found {found!r}.", *place, key)
        return found

    def reference(self, key: str, *place: str | int, default: str | None = None) -> str:
        """A text that may name code, as a model or a law is named.

        Raises:
            StickslipError: no text, or code that the user does not trust.
        """
        found = self.text(key, *place, default=default)
        try:
            admit(found, self.path.parent, trust=self.trust)
        except StickslipError as error:
            raise self.fault(str(error), *place, key) from None
        return found

    def names(self, key: str, *place: str) -> tuple[str, ...] | None:
        """A list of names; None if there is none."""
        found = self.table(*place).get(key)
        if found is None:
            return None
        if not isinstance(found, list) or not all(isinstance(name, str) for name in found):
            raise self.fault(f"'{key}' must be a list of names, such as [\"disc0\"], found {found!r}.", *place, key)
        for i, name in enumerate(found):
            if name in found[:i]:
                raise self.fault(f"'{name}' stands twice in '{key}'. Name it once.", *place, key)
        return tuple(found)

    def flag(self, key: str, *place: str) -> bool:
        """True or false; false if left out."""
        found = self.table(*place).get(key, False)
        if not isinstance(found, bool):
            raise self.fault(f"'{key}' must be true or false, found {found!r}.", *place, key)
        return found

    def count(self, key: str, default: int, least: int, *place: str) -> int:
        """A whole number, at least ``least``."""
        found = self.table(*place).get(key, default)
        if isinstance(found, bool) or not isinstance(found, int) or found < least:
            raise self.fault(f"'{key}' must be a whole number from {least} on, found {found!r}.", *place, key)
        return found

    def numbers(self, *place: str | int, texts: bool = False) -> dict[str, Any]:
        """A table of numbers without units; texts: as they are, rather than refused."""
        table = self.table(*place)
        for name, found in table.items():
            if isinstance(found, str) and not texts:
                raise self.fault(f"'{name}' must be a finite number, found {found!r}.", *place, name)
        return {n: v if isinstance(v, str) else self.value(v, "1", *place, n) for n, v in table.items()}

    def values(self, raw: Any, unit: str, *place: str | int) -> list[float]:
        """A list of values; or as many as ``count``, evenly spaced, ``{ from = ..., to = ..., count = ... }``."""
        if isinstance(raw, list):
            return [self.value(entry, unit, *place, i) for i, entry in enumerate(raw)]
        if not isinstance(raw, dict) or not _RANGE & raw.keys():
            raise self.fault(
                f"'{place[-1]}' must be a list of values, or {{ from = ..., to = ..., count = ... }}, found {raw!r}.",
                *place,
            )
        for key in sorted(raw.keys() ^ _RANGE):
            said = "is missing" if key in _RANGE else "is not a part"
            raise self.fault(f"'{key}' {said} of the range '{place[-1]}', which has from, to and count.", *place)
        low, high = (self.value(raw[key], unit, *place, key) for key in ("from", "to"))
        count = raw["count"]
        if isinstance(count, bool) or not isinstance(count, int) or count < 2:
            raise self.fault(f"'count' must be a whole number from 2 on, found {count!r}.", *place, "count")
        step = (high - low) / (count - 1)
        return [*(i * step + low for i in range(count - 1)), high]

    def value(self, raw: Any, unit: str, *place: str | int) -> float:
        """A number, or a text of number and unit, in ``unit``.

        Raises:
            StickslipError: neither, not finite, an unknown unit, or a unit of something else.
        """
        what = str(place[-1] if isinstance(place[-1], str) else place[-2])
        if isinstance(raw, bool) or not isinstance(raw, int | float | str):
            raise self.fault(
                f"'{what}' must be a number in {unit}, or a text such as \"1 {unit}\", found {raw!r}.", *place
            )
        if isinstance(raw, str):
            try:
                raw = converted(raw, unit, f"'{what}'")
            except StickslipError as error:
                raise self.fault(str(error), *place) from error
        try:
            found = float(raw)
        except OverflowError:
            found = math.inf
        if not math.isfinite(found):
            raise self.fault(f"'{what}' must be a finite number, found {str(raw)[:30]}.", *place)
        return found


def converted(text: str, unit: str, what: str) -> float:
    """A text of number and unit, as a number in ``unit``.

    Raises:
        StickslipError: no number, an unknown unit, or a unit of something else; begins with ``what``.
    """
    from pint import DimensionalityError, PintError

    from fmu_models.base.unit_names import known_units, parse_unit

    match = _NUMBER.match(text)
    if not match:
        raise StickslipError(f'{what} must be a number with a unit, such as "1 {unit}", found "{text}".')
    number, given = float(match[1]), match[2]
    if not given or given == unit:
        return number
    try:
        scale = parse_unit(given).to(parse_unit(unit).units)
    except DimensionalityError as error:
        raise StickslipError(f'{what} = "{text}" cannot be converted to {unit}, its unit.') from error
    except (PintError, ValueError) as error:
        unknown = _unknown(given)
        close = difflib.get_close_matches(unknown, known_units(), n=1, cutoff=0.6)
        hint = f"Did you mean '{close[0]}'?" if close else f"Its unit is {unit}."
        wrong = f"'{unknown}' is not a unit" if unknown else str(error)
        raise StickslipError(f'{what} = "{text}": {wrong}. {hint}') from error
    return number * float(scale.magnitude)


def _unknown(unit: str) -> str:
    """The word of a unit that is not one, empty if all are."""
    from fmu_models.base.unit_names import parse_unit

    for word in re.findall(r"[^\W\d]+", unit):
        try:
            parse_unit(word)
        except ValueError:
            return word
    return ""


def read_document(path: Path, *, trust: bool = False) -> Document:
    """Read a file; trust: as in `Document`.

    Raises:
        StickslipError: it cannot be read, or is not TOML.
    """
    try:
        return Document(path, path.read_text("utf-8"), trust=trust)
    except (OSError, UnicodeDecodeError) as error:
        raise StickslipError(f"'{path}' cannot be read ({error}). Give a TOML file.") from error


def _index(text: str) -> Mapping[tuple[str | int, ...], int]:
    """Line of every table and key."""
    found: dict[tuple[str | int, ...], int] = {}
    table: tuple[str | int, ...] = ()
    counts: dict[tuple[str | int, ...], int] = {}
    for number, line in enumerate(text.splitlines(), 1):
        if header := _HEADER.match(line):
            table = _keys(header[2])
            if header[1] == "[[":
                counts[table] = counts.get(table, -1) + 1
                table = (*table, counts[table])
            found.setdefault(table, number)
        elif key := _KEY.match(line):
            found.setdefault((*table, *_keys(key[1])), number)
    return found


def _keys(text: str) -> tuple[str | int, ...]:
    return tuple(part.strip().strip("\"'") for part in text.split("."))
