"""Results as JSON has them: what a class names in ``RECORD``, or the fields of a dataclass, as plain values."""

import dataclasses
import math
import operator
from collections.abc import Mapping
from typing import Any


def record(value: object) -> Any:
    """A value in dictionaries, lists, texts and numbers, which JSON can hold.

    ``RECORD`` lists attributes of a class: "name", or "key=name" where the key is another, and "key=part.name" of one
    inside. A field that no comparison sees (what is behind a result) is left out. Arrays become lists, complex numbers
    pairs, numbers that are not finite None.
    """
    names = getattr(type(value), "RECORD", None)
    if names is not None:
        pairs = (name.partition("=") for name in names)
        return {key: record(_attribute(value, name or key)) for key, _, name in pairs}
    if isinstance(value, Mapping):
        return {str(key): record(inner) for key, inner in value.items()}
    if dataclasses.is_dataclass(value):
        return {field.name: record(getattr(value, field.name)) for field in dataclasses.fields(value) if field.compare}
    if hasattr(value, "tolist"):  # arrays and scalars of numpy, which need not be imported for this
        return record(operator.methodcaller("tolist")(value))
    if isinstance(value, list | tuple | set | frozenset):
        return [record(inner) for inner in value]
    if isinstance(value, complex):
        return [record(value.real), record(value.imag)]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def _attribute(value: object, name: str) -> object:
    member = operator.attrgetter(name)(value)
    return member() if callable(member) else member


class Recorded:
    """A value with its plain form as a method."""

    def to_dict(self) -> dict[str, Any]:
        """As plain values for JSON; see `record`."""
        return record(self)
