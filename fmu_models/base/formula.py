"""Formulas in files and on command lines: arithmetic of names and numbers, and a few functions; nothing else."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError, refuse_unknown

_OPERATORS: dict[type, Callable[..., Any]] = {
    **{ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide, ast.Pow: np.float_power},
    **{ast.USub: np.negative, ast.UAdd: np.positive},
}
_FUNCTIONS = ("sqrt", "hypot", "sin", "cos", "tan", "arcsin", "arccos", "arctan2", "exp", "log", "abs")
_CONSTANTS = {"pi": np.pi}


@dataclass(frozen=True)
class Formula:
    """A formula such as ``f0/sqrt((k - m*omega**2)**2 + (c*omega)**2)``.

    Attributes:
        text: as it was given.
        names: of what it is made of.
    """

    text: str
    names: tuple[str, ...]

    @classmethod
    def read(cls, text: str) -> Formula:
        """The formula of a text. StickslipError: no formula, or something else than arithmetic and the known functions
        in it."""
        try:
            body = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError) as error:
            raise StickslipError(f"'{text}' is no formula: {error}. Write one as f0/sqrt((1 - omega**2)**2).") from None
        names: dict[str, None] = {}
        for node in ast.walk(body):
            if isinstance(node, ast.Name) and node.id not in (*_FUNCTIONS, *_CONSTANTS):
                names[node.id] = None
        formula = cls(text.strip(), tuple(names))
        formula(dict.fromkeys(names, np.ones(1)))
        return formula

    def __call__(self, values: Mapping[str, Any]) -> float | NDArray[Any]:
        """The formula's value; nan where it has none.

        Args:
            values: of all its names, numbers or arrays of one shape.

        Raises:
            StickslipError: a name without a value.
        """
        with np.errstate(all="ignore"):
            return self._value(ast.parse(self.text, mode="eval").body, values)

    def _value(self, node: ast.AST, values: Mapping[str, Any]) -> float | NDArray[Any]:
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return float(node.value)
        if isinstance(node, ast.Name) and node.id in _CONSTANTS:
            return _CONSTANTS[node.id]
        if isinstance(node, ast.Name):
            refuse_unknown(node.id, values, f"'{node.id}' in '{self.text}' has no value.")
            return values[node.id]
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
            return _OPERATORS[type(node.op)](self._value(node.left, values), self._value(node.right, values))
        if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
            return _OPERATORS[type(node.op)](self._value(node.operand, values))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _FUNCTIONS:
            function = getattr(np, node.func.id)
            if node.keywords or len(node.args) != function.nin:
                raise StickslipError(f"'{node.func.id}' in '{self.text}' takes {function.nin} values.")
            return function(*(self._value(argument, values) for argument in node.args))
        raise StickslipError(
            f"'{ast.unparse(node)}' in '{self.text}' is nothing that a formula has: names, numbers, + - * / **, "
            f"{', '.join(_FUNCTIONS)}, pi."
        )
