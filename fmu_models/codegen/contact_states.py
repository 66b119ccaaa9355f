"""States of contacts: the numbers of the engine, which variables ``<contact>_state`` show, and words for them."""

from __future__ import annotations

from fmu_models.codegen.c_structures import declarations

_STATES = declarations("engine/model/model.h").constants("ContactState", "CONTACT_")
SLIP_MINUS: int = _STATES.SLIP_MINUS
STICK: int = _STATES.STICK
SLIP_PLUS: int = _STATES.SLIP_PLUS
AWAY: int = _STATES.AWAY
TOUCHING: int = _STATES.TOUCHING
RELEASED: int = _STATES.RELEASED
CHATTERING: int = _STATES.CHATTERING
_TICKS = declarations("engine/model/model.h").constants("Tick", "TICK_")
# of a rigid contact
OPEN, CLOSED = AWAY, TOUCHING

CONTACT_STATES = {
    **{SLIP_MINUS: "slip-", STICK: "stick", SLIP_PLUS: "slip+", AWAY: "away", TOUCHING: "touching"},
    **{RELEASED: "released", CHATTERING: "chattering"},
}
RIGID_STATES = CONTACT_STATES | {OPEN: "open", CLOSED: "closed"}

_FRICTION = {SLIP_MINUS: "slip in negative direction", STICK: "stick", SLIP_PLUS: "slip in positive direction"}
# by kind of contact
MEANINGS = {
    "friction": _FRICTION | {AWAY: "away"},
    "stop": {AWAY: "away", TOUCHING: "touching", RELEASED: "released while still inside"},
    "switch": {SLIP_MINUS: "negative side", STICK: "sliding", SLIP_PLUS: "positive side"},
    "impact": {
        **{OPEN: "open", CLOSED: "closed"},
        **{CHATTERING: "chattering (closed while infinitely many small bounces die out)"},
    },
    "impact_friction": _FRICTION | {AWAY: "away (open)"},
}


# what the clocks of contacts tick at, and which of them each kind of contact has
TICKS = {
    "stick": "ticks where the contact begins to stick",
    "slip": "ticks where the contact begins to slip, or to slip the other way",
    "impact": "ticks where the bodies meet",
}
CLOCKS = {
    "friction": ("stick", "slip"),
    "stop": ("impact",),
    "switch": (),
    "impact": ("impact",),
    "impact_friction": ("stick", "slip"),
}


def clocks(kind: str) -> int:
    """The same for the engine: the sum of its ticks."""
    return sum(getattr(_TICKS, name.upper()) for name in CLOCKS[kind])


def meaning(kind: str) -> str:
    """What the numbers say for a kind of contact."""
    return ", ".join(f"{number} {text}" for number, text in MEANINGS[kind].items())


def type_name(kind: str) -> str:
    """The declared type of the variable of a kind of contact, such as "ImpactFrictionState"."""
    return f"{kind.title().replace('_', '')}State"
