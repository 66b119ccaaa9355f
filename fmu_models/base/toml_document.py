"""A TOML file whose faults can be named by their line."""

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

    def line(self, *keys: str | int) -> int | None:
        """Line of a key, or of the nearest table around it; from 1."""
        for length in range(len(keys), 0, -1):
            if line := self._lines.get(keys[:length]):
                for key in keys[length:]:
                    line = self._inside(line, key)
                return line
        return None

    def _inside(self, start: int, key: str | int) -> int:
        """Line of a word, or of a table by its number, in a value that begins in a line: values may take several."""
        pattern = re.compile(rf"\b{re.escape(key)}\b" if isinstance(key, str) else r"\{")
        before = key if isinstance(key, int) else 0
        for number, text in enumerate(self._text.splitlines()[start - 1 :], start):
            if number > start and (_HEADER.match(text) or _KEY.match(text)):
                break
            before -= len(pattern.findall(text))
            if before < 0:
                return number
        return start

    def fault(self, message: str, *keys: str | int) -> StickslipError:
        """The error to raise for what stands at a place."""
        number = self.line(*keys)
        return StickslipError(f"{self.path}, line {number}: {message}" if number else f"{self.path}: {message}")

    def check_keys(self, names: Iterable[str], *keys: str | int) -> None:
        """Refuse keys of a table that nobody reads. StickslipError: which, and the nearest known one."""
        choices = list(names)
        for key in self.table(*keys):
            if key not in choices:
                where = f"in [{'.'.join(p for p in keys if isinstance(p, str))}]" if keys else "at the top of the file"
                raise self.fault(f"'{key}' is not a key {where}.{nearest(key, choices)}", *keys, key)

    def table(self, *keys: str | int) -> dict[str, Any]:
        """The table at a place, empty if there is none."""
        value: Any = self.data
        for key in keys:
            value = value.get(key, {}) if isinstance(value, dict) else value[key]
        if not isinstance(value, dict):
            raise self.fault(f"'{keys[-1]}' must be a table of names and values, found {value!r}.", *keys)
        return value

    def entries(self, key: str) -> list[dict[str, Any]]:
        """The tables of a list, none if it is left out."""
        tables = self.data.get(key, [])
        if not isinstance(tables, list):
            raise self.fault(f"'{key}' must be tables, each written as [[{key}]], in double brackets.", key)
        for i, entry in enumerate(tables):
            if not isinstance(entry, dict):
                raise self.fault(f"'{key}' must be tables, {{ name = value }}; number {i + 1} is {entry!r}.", key, i)
        return tables

    def text(self, key: str, *keys: str | int, default: str | None = None) -> str:
        """A text."""
        value = self.table(*keys).get(key, default)
        if value is None:
            raise self.fault(f"'{key}' is missing. Add it: {key} = \"...\"", *keys)
        if not isinstance(value, str):
            raise self.fault(f"'{key}' must be a text in quotation marks, found {value!r}.", *keys, key)
        return value

    def reference(self, key: str, *keys: str | int, default: str | None = None) -> str:
        """A text that may name code, as a model or a law is named. StickslipError: no text, or code that the user does
        not trust."""
        value = self.text(key, *keys, default=default)
        try:
            admit(value, self.path.parent, trust=self.trust)
        except StickslipError as error:
            raise self.fault(str(error), *keys, key) from None
        return value

    def names(self, key: str, *keys: str) -> tuple[str, ...] | None:
        """A list of names; None if there is none."""
        names = self.table(*keys).get(key)
        if names is None:
            return None
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise self.fault(f"'{key}' must be a list of names, such as [\"disc0\"], found {names!r}.", *keys, key)
        for i, name in enumerate(names):
            if name in names[:i]:
                raise self.fault(f"'{name}' stands twice in '{key}'. Name it once.", *keys, key)
        return tuple(names)

    def flag(self, key: str, *keys: str) -> bool:
        """True or false; false if left out."""
        value = self.table(*keys).get(key, False)
        if not isinstance(value, bool):
            raise self.fault(f"'{key}' must be true or false, found {value!r}.", *keys, key)
        return value

    def count(self, key: str, default: int, least: int, *keys: str) -> int:
        """A whole number, at least ``least``."""
        value = self.table(*keys).get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise self.fault(f"'{key}' must be a whole number from {least} on, found {value!r}.", *keys, key)
        return value

    def numbers(self, *keys: str | int, texts: bool = False) -> dict[str, Any]:
        """A table of numbers without units; texts: as they are, rather than refused."""
        table = self.table(*keys)
        for name, value in table.items():
            if isinstance(value, str) and not texts:
                raise self.fault(f"'{name}' must be a finite number, found {value!r}.", *keys, name)
        return {n: v if isinstance(v, str) else self.value(v, "1", *keys, n) for n, v in table.items()}

    def values(self, raw: object, unit: str, *keys: str | int) -> list[float]:
        """A list of values; or as many as ``count``, evenly spaced, ``{ from = ..., to = ..., count = ... }``."""
        if isinstance(raw, list):
            return [self.value(entry, unit, *keys, i) for i, entry in enumerate(raw)]
        if not isinstance(raw, dict) or not _RANGE & raw.keys():
            raise self.fault(
                f"'{keys[-1]}' must be a list of values, or {{ from = ..., to = ..., count = ... }}, found {raw!r}.",
                *keys,
            )
        for key in sorted(raw.keys() ^ _RANGE):
            problem = "is missing" if key in _RANGE else "is not a part"
            raise self.fault(f"'{key}' {problem} of the range '{keys[-1]}', which has from, to and count.", *keys)
        low, high = (self.value(raw[key], unit, *keys, key) for key in ("from", "to"))
        count = raw["count"]
        if isinstance(count, bool) or not isinstance(count, int) or count < 2:
            raise self.fault(f"'count' must be a whole number from 2 on, found {count!r}.", *keys, "count")
        step = (high - low) / (count - 1)
        return [*(i * step + low for i in range(count - 1)), high]

    def value(self, raw: object, unit: str, *keys: str | int) -> float:
        """A number, or a text of number and unit, in ``unit``. StickslipError: neither, not finite, an unknown unit, or
        a unit of something else."""
        name = str(keys[-1] if isinstance(keys[-1], str) else keys[-2])
        if isinstance(raw, bool) or not isinstance(raw, int | float | str):
            raise self.fault(
                f"'{name}' must be a number in {unit}, or a text such as \"1 {unit}\", found {raw!r}.", *keys
            )
        if isinstance(raw, str):
            try:
                raw = converted(raw, unit, f"'{name}'")
            except StickslipError as error:
                raise self.fault(str(error), *keys) from error
        try:
            number = float(raw)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self.fault(f"'{name}' must be a finite number, found {str(raw)[:30]}.", *keys)
        return number


def converted(text: str, unit: str, label: str) -> float:
    """A text of number and unit, as a number in ``unit``. StickslipError: no number, an unknown unit, or a unit of
    something else; begins with ``label``."""
    from fmu_models.base.unit_names import OtherDimensionError, conversion_factor, known_units

    match = _NUMBER.match(text)
    if not match:
        raise StickslipError(f'{label} must be a number with a unit, such as "1 {unit}", found "{text}".')
    number, source = float(match[1]), match[2]
    if not source or source == unit:
        return number
    try:
        return number * conversion_factor(source, unit)
    except OtherDimensionError as error:
        raise StickslipError(f'{label} = "{text}" cannot be converted to {unit}, its unit.') from error
    except ValueError as error:
        unknown = _unknown(source)
        close = difflib.get_close_matches(unknown, known_units(), n=1, cutoff=0.6)
        hint = f"Did you mean '{close[0]}'?" if close else f"Its unit is {unit}."
        wrong = f"'{unknown}' is not a unit" if unknown else str(error)
        raise StickslipError(f'{label} = "{text}": {wrong}. {hint}') from error


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
    """Read a file; trust: as in `Document`. StickslipError: it cannot be read, or is not TOML."""
    try:
        return Document(path, path.read_text("utf-8"), trust=trust)
    except (OSError, UnicodeDecodeError) as error:
        raise StickslipError(f"'{path}' cannot be read ({error}). Give a TOML file.") from error


def _index(text: str) -> Mapping[tuple[str | int, ...], int]:
    """Line of every table and key."""
    lines: dict[tuple[str | int, ...], int] = {}
    table: tuple[str | int, ...] = ()
    counts: dict[tuple[str | int, ...], int] = {}
    for number, line in enumerate(text.splitlines(), 1):
        if header := _HEADER.match(line):
            table = _keys(header[2])
            if header[1] == "[[":
                counts[table] = counts.get(table, -1) + 1
                table = (*table, counts[table])
            lines.setdefault(table, number)
        elif key := _KEY.match(line):
            lines.setdefault((*table, *_keys(key[1])), number)
    return lines


def _keys(text: str) -> tuple[str | int, ...]:
    return tuple(word.strip().strip("\"'") for word in text.split("."))
