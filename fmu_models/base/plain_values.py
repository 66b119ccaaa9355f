"""Frozen dataclasses from plain values, as `dataclasses.asdict` and JSON give them, held against their annotations."""

from __future__ import annotations

import collections.abc
import dataclasses
import types
import typing
from typing import Any, TypeVar

from fmu_models.base.errors import StickslipError

Value = TypeVar("Value")

LARGEST = 2**63 - 1  # of counts: what arrays and other programs hold
_WORDS = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}


def from_plain(kind: type[Value], plain: Any, place: str) -> Value:
    """An instance of a dataclass, with all that it holds.

    Args:
        kind: of fields annotated as float, int, str, bool, tuples of one type, mappings from texts, dataclasses, or one
            of these or None; a field that is no part of ``__init__``'s plain arguments keeps its default.
        place: what ``plain`` is called in an error.

    Raises:
        StickslipError: a field is missing, unknown, or holds another type; says which and what was expected.
    """
    if not isinstance(plain, dict):
        raise _fault(place, "an object", plain)
    hints = typing.get_type_hints(kind)
    fields: Any = {field.name: field for field in dataclasses.fields(kind)}  # pyright: ignore[reportArgumentType]
    for name in plain:
        if name not in fields:
            raise StickslipError(f"{place} has an unknown entry '{name}'.")
    given = {}
    for name, field in fields.items():
        if name in plain:
            given[name] = _value(hints[name], plain[name], f"{place}.{name}")
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise StickslipError(f"{place} is incomplete: '{name}' is missing.")
    return kind(**given)


def _value(hint: Any, value: Any, place: str) -> Any:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        (inner,) = (one for one in arguments if one is not types.NoneType)
        return None if value is None else _value(inner, value, place)
    if dataclasses.is_dataclass(hint):
        return from_plain(typing.cast(type, hint), value, place)
    if origin is tuple:
        if not isinstance(value, list | tuple):
            raise _fault(place, "a list", value)
        return tuple(_value(arguments[0], one, f"{place}[{i}]") for i, one in enumerate(value))
    if origin in (dict, collections.abc.Mapping):
        if not isinstance(value, dict):
            raise _fault(place, "an object", value)
        return {name: _value(arguments[1], one, f"{place}.{name}") for name, one in value.items()}
    return _single(hint, value, place)


def _single(hint: Any, value: Any, place: str) -> Any:
    if hint is float and isinstance(value, int | float) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            raise _fault(place, "a number of a size that numbers can have", "one of many digits") from None
    if type(value) is not hint:
        raise _fault(place, _WORDS[hint], value)
    if hint is int and abs(value) > LARGEST:
        raise _fault(place, "a whole number of a size that counts can have", "one of many digits")
    return value


def _fault(place: str, expected: str, found: Any) -> StickslipError:
    shown = repr(found)
    return StickslipError(f"{place} must be {expected}, found {shown if len(shown) < 60 else shown[:60] + '...'}.")
