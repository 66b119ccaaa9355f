"""Commands of which plain options are read without pydantic, which typer imports for each: a fifth of a short command.

A text, a path, and a number that is one at first sight and within its bounds are taken as typer would take them;
everything else, and whatever is to be refused, goes typer's way.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from typer.core import TyperCommand, TyperGroup

try:
    from typer._coercion import RuntimeParam, build_runtime_param
    from typer._param_types import coerce_cli_path
except ImportError:  # private names: a typer that has none reads all options itself
    RuntimeParam, build_runtime_param, coerce_cli_path = cast("Any", (object, None, None))

_NUMBERS: dict[Any, re.Pattern[str]] = {
    int: re.compile(r"[+-]?\d{1,15}", re.ASCII),
    float: re.compile(r"[+-]?\d+(\.\d*)?(e[+-]?\d+)?", re.ASCII | re.I),
}


class _Plainly:
    """Mixed into a class of typer's: options are seen to before they are read; some are added late."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """As typer does."""
        for parameter in self.get_params(ctx) if build_runtime_param else ():  # type: ignore[attr-defined]
            if (stated := getattr(parameter, "type_descriptor", None)) is not None:
                parameter._runtime_param = _Plain(stated.parameter_info, stated.annotation, stated)
        return super().parse_args(ctx, args)  # type: ignore[misc] # that of the class it is mixed into


class PlainCommand(_Plainly, TyperCommand):
    """A command of typer, ``app.command(cls=PlainCommand)``."""


class PlainGroup(_Plainly, TyperGroup):
    """A group of commands of typer, ``Typer(cls=PlainGroup)``."""


@dataclass(frozen=True)
class _Plain(RuntimeParam):  # type: ignore[misc] # Any where typer has none
    """One option. What is not given, typer's base class answers."""

    described: Any

    def _coerce_value(self, value: Any, param: Any, ctx: Any) -> Any:
        info: Any = self.parameter_info
        kind = cast("Any", self.annotation)
        if info.parser is None:
            if kind is str and isinstance(value, str):
                return value
            if kind == list[str] and all(isinstance(text, str) for text in value):
                return list(value)
            if kind is Path and str(Path(value)) == value and info.path_type is None:
                return coerce_cli_path(Path(value), info, path_type=Path, param=param, ctx=ctx)
            pattern = _NUMBERS.get(kind) if isinstance(value, str) and not info.clamp else None
            if pattern and pattern.fullmatch(value):
                number = kind(value)
                if (info.min is None or info.min <= number) and (info.max is None or number <= info.max):
                    return number
        return build_runtime_param(self.described)._coerce_value(value, param=param, ctx=ctx)
