"""A hybrid system as plain data: texts of expressions, numbers and names, from which either side builds its own.

Names in expressions: coordinates q0, q1, ... with velocities v0, v1, ...; t; inputs; parameters; of a system without a
body its states x0, x1, ... and the signs of its switches, sign_<name>. Functions: sin cos exp log sqrt tanh atan.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Declaration:
    """A mechanism, or an automaton if it has ``flows``.

    Attributes:
        states: coordinates, or the states of an automaton.
        parameters, inputs: names.
        kinetic, potential, dissipation: T, U, D.
        applied: generalised force by coordinate.
        flows: rate by state.
        contacts: each a mapping with its kind and name and
            friction  slip, law, perhaps where
            stop      gap, law, release ("gap" or "force")
            impact    gap, rule ("newton" or "poisson"), e, perhaps slip and mu
            sliders   way, k and D (lists, as long as one another)
            switch    function, perhaps side and to (its reset).
            A law is a mapping with its name and its parts, texts or numbers, perhaps a law again.
    """

    states: tuple[str, ...]
    parameters: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()
    kinetic: str = "0"
    potential: str = "0"
    dissipation: str = "0"
    applied: Mapping[str, str] = field(default_factory=dict)
    flows: Mapping[str, str] = field(default_factory=dict)
    contacts: Sequence[Mapping[str, Any]] = ()

    @property
    def velocities(self) -> tuple[str, ...]:
        """None of an automaton."""
        return () if self.flows else tuple(f"v{name[1:]}" for name in self.states)


@dataclass(frozen=True)
class Values:
    """One run: numbers by name; inputs are polygons (times, values); ``features``: centres and widths of pulses."""

    end: float
    parameters: Mapping[str, float]
    start: Mapping[str, float]
    inputs: Mapping[str, tuple[tuple[float, ...], tuple[float, ...]]] = field(default_factory=dict)
    features: tuple[tuple[float, float], ...] = ()
