"""Frozen dataclasses from plain values, as `dataclasses.asdict` and JSON give them, held against their annotations."""

import collections.abc
import dataclasses
import types
import typing
from typing import Any, TypeVar

from fmu_models.base.errors import StickslipError

Value = TypeVar("Value")

LARGEST = 2**63 - 1  # of counts: what arrays and other programs hold
_WORDS: dict[object, str] = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}


def from_plain(kind: type[Value], plain: object, label: str) -> Value:
    """An instance of a dataclass, with all that it holds.

    Args:
        kind: of fields annotated as float, int, str, bool, tuples of one type, mappings from texts, dataclasses, or one
            of these or None; what is of one of several types, or of any, is taken as it is. A field that is no part of
            ``__init__``'s plain arguments keeps its default.
        label: what ``plain`` is called in an error.

    Raises:
        StickslipError: a field is missing, unknown, or holds another type; says which and what was expected.
    """
    if not isinstance(plain, dict):
        raise _fault(label, "an object", plain)
    hints = typing.get_type_hints(kind)
    fields: Any = {field.name: field for field in dataclasses.fields(kind)}  # pyright: ignore[reportArgumentType]
    for name in plain:
        if name not in fields:
            raise StickslipError(f"{label} has an unknown entry '{name}'.")
    arguments = {}
    for name, field in fields.items():
        if name in plain:
            arguments[name] = _value(hints[name], plain[name], f"{label}.{name}")
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise StickslipError(f"{label} is incomplete: '{name}' is missing.")
    return kind(**arguments)


def _value(hint: object, value: object, label: str) -> object:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        inner, *others = (argument for argument in arguments if argument is not types.NoneType)
        return value if value is None or others else _value(inner, value, label)
    if hint is Any:
        return value
    if dataclasses.is_dataclass(hint):
        return from_plain(typing.cast(type, hint), value, label)
    if origin is tuple:
        if not isinstance(value, list | tuple):
            raise _fault(label, "a list", value)
        return tuple(_value(arguments[0], entry, f"{label}[{i}]") for i, entry in enumerate(value))
    if origin in (dict, collections.abc.Mapping):
        if not isinstance(value, dict):
            raise _fault(label, "an object", value)
        return {name: _value(arguments[1], entry, f"{label}.{name}") for name, entry in value.items()}
    return _single(hint, value, label)


def _single(hint: object, value: object, label: str) -> object:
    if hint is float and isinstance(value, int | float) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            raise _fault(label, "a number of a size that numbers can have", "one of many digits") from None
    if type(value) is not hint:
        raise _fault(label, _WORDS[hint], value)
    if hint is int and isinstance(value, int) and abs(value) > LARGEST:
        raise _fault(label, "a whole number of a size that counts can have", "one of many digits")
    return value


def _fault(label: str, expected: str, value: object) -> StickslipError:
    text = repr(value)
    return StickslipError(f"{label} must be {expected}, found {text if len(text) < 60 else text[:60] + '...'}.")
