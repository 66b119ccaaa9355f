"""The table of contact kinds: what lowering, generated code, engine, reports and validation know of a contact.

A kind is a row of data. Whoever needs to know how a contact behaves asks its kind for a property, never for its name:

                     normal  rigid  surface
    friction           -       -       -      a force by its law in slip, whatever holds in stick
    stop               x       -       -      a force by its law while it touches
    switch             -       -       x      Filippov's mean of two flows where it slides
    yield              -       -       x      whatever holds a state at its bound, pushing inwards
    impact             x       x       -      whatever keeps the gap closed, and impulses
    impact_friction    -       x       -      bounded by mu times the force of its partner
    cone               -       -       -      friction with two directions: its slip, its law, whether it sticks
    cone_side          -       -       -      one of its directions, where its forces act

A declared contact lowers to one or several of these (``dynamics``); a new declaration that lowers to rows which stand
here needs nothing else. The generated C has the numbers of the states and the properties of every contact from here.
"""

from collections.abc import Mapping
from dataclasses import dataclass

# states: the numbers that variables ``<contact>_state`` show
SLIP_MINUS, STICK, SLIP_PLUS, AWAY, TOUCHING, RELEASED, CHATTERING = range(-1, 6)
# of a rigid contact
OPEN, CLOSED = AWAY, TOUCHING
STATES = {
    **{"SLIP_MINUS": SLIP_MINUS, "STICK": STICK, "SLIP_PLUS": SLIP_PLUS, "AWAY": AWAY},
    **{"TOUCHING": TOUCHING, "RELEASED": RELEASED, "CHATTERING": CHATTERING},
}
CONTACT_STATES = {
    **{SLIP_MINUS: "slip-", STICK: "stick", SLIP_PLUS: "slip+", AWAY: "away", TOUCHING: "touching"},
    **{RELEASED: "released", CHATTERING: "chattering"},
}
RIGID_STATES = CONTACT_STATES | {OPEN: "open", CLOSED: "closed"}

# what the clocks of contacts tick at
TICKS = {
    "stick": "ticks where the contact begins to stick",
    "slip": "ticks where the contact begins to slip, or to slip the other way",
    "impact": "ticks where the bodies meet",
    "reset": "ticks where states jump",
}
TICK_BITS = {name: 1 << i for i, name in enumerate(TICKS)}

# by what an event indicator watches: the end of its variable's name, and its value in words
INDICATORS = {
    "depth": ("bound", "depth, or its negative while away"),
    "slip": ("indicator", "|slip speed|; in stick what lambda lacks of its nearer bound"),
    "release": ("release", "force while touching, its negative once released"),
    "function": ("indicator", "|h|; while sliding 1 - |mean sign|"),
    "gap": ("indicator", "gap; closed the normal force"),
}


@dataclass(frozen=True, eq=False)
class ContactKind:
    """A row of the table.

    Attributes:
        name: as reports and the names of types have it.
        meanings: its states, each with what it means.
        state_words: the same in a word, in the order of sheets.
        clocks: keys of ``TICKS``.
        watched: what its tangential indicator watches, "" if it has none.
        bound: what its normal indicator watches, if it has a depth.
        spell: the state that a figure shades, and the word beside it.
        normal: y is the rate of its depth: a force along a gap, else along a surface.
        rigid: its force has no law of its own: all of these come from one system of equations, impulses too.
        surface: y is a switching function, not a speed.
        yields: y is what is left of a state to its bound, which holds it from one side.
        cone: y is the length of a vector, of which the contacts behind it have a side each.
        side: its state is that of the cone before it.
    """

    name: str
    meanings: Mapping[int, str]
    state_words: Mapping[int, str]
    clocks: tuple[str, ...]
    watched: str
    spell: tuple[str, frozenset[int]]
    bound: str = "depth"
    normal: bool = False
    rigid: bool = False
    surface: bool = False
    yields: bool = False
    cone: bool = False
    side: bool = False

    @property
    def words(self) -> str:
        """The name for people."""
        return self.name.replace("_", " ")

    @property
    def type_name(self) -> str:
        """The declared type of the variable of its state, such as "ImpactFrictionState"."""
        return f"{self.name.title().replace('_', '')}State"

    @property
    def meaning(self) -> str:
        """What the numbers of its states say."""
        return ", ".join(f"{number} {text}" for number, text in self.meanings.items())

    @property
    def impulsive(self) -> bool:
        """Whether it answers its closing by an impulse: the normal direction of a rigid contact."""
        return self.normal and self.rigid

    @property
    def compliant(self) -> bool:
        """Whether it gives way along a gap by a law."""
        return self.normal and not self.rigid

    @property
    def led(self) -> bool:
        """Whether a partner's force bounds its own: the friction of a rigid contact."""
        return self.rigid and not self.normal

    @property
    def dry(self) -> bool:
        """Whether it has a bound of its own for what holds y at zero."""
        return not self.normal and not self.rigid

    @property
    def rubs(self) -> bool:
        """Whether it is dry, along a speed."""
        return self.dry and not self.surface and not self.side


_FRICTION = {SLIP_MINUS: "slip in negative direction", STICK: "stick", SLIP_PLUS: "slip in positive direction"}
_RUBS = {SLIP_PLUS: "slip+", SLIP_MINUS: "slip-", STICK: "stick", AWAY: "away"}
_STICKS = ("stick", frozenset({STICK}))

FRICTION = ContactKind("friction", _FRICTION | {AWAY: "away"}, _RUBS, ("stick", "slip"), "slip", _STICKS)
STOP = ContactKind(
    "stop",
    {AWAY: "away", TOUCHING: "touching", RELEASED: "released while still inside"},
    {AWAY: "away", TOUCHING: "touching", RELEASED: "released"},
    ("impact",),
    "release",
    ("contact", frozenset({TOUCHING})),
    normal=True,
)
SWITCH = ContactKind(
    "switch",
    {SLIP_MINUS: "negative side", STICK: "sliding", SLIP_PLUS: "positive side"},
    {SLIP_PLUS: "+", SLIP_MINUS: "-", STICK: "sliding"},
    ("reset",),
    "function",
    ("sliding", frozenset({STICK})),
    surface=True,
)
YIELD = ContactKind(
    "yield",
    {SLIP_MINUS: "beyond its bound", STICK: "yields at its bound", SLIP_PLUS: "elastic"},
    {SLIP_PLUS: "elastic", SLIP_MINUS: "beyond", STICK: "yields"},
    (),
    "function",
    ("yields", frozenset({STICK})),
    surface=True,
    yields=True,
)
IMPACT = ContactKind(
    "impact",
    {OPEN: "open", CLOSED: "closed", CHATTERING: "chattering (closed while infinitely many small bounces die out)"},
    {OPEN: "open", CLOSED: "closed", CHATTERING: "chattering"},
    ("impact",),
    "",
    ("contact", frozenset(STATES.values()) - {AWAY}),
    bound="gap",
    normal=True,
    rigid=True,
)
IMPACT_FRICTION = ContactKind(
    "impact_friction", _FRICTION | {AWAY: "away (open)"}, _RUBS, ("stick", "slip"), "slip", _STICKS, rigid=True
)
_TURNS = {SLIP_PLUS: "slip", STICK: "stick", AWAY: "away"}
CONE = ContactKind("cone", _TURNS, _TURNS, ("stick", "slip"), "slip", _STICKS, cone=True)
CONE_SIDE = ContactKind("cone_side", _TURNS, _TURNS, (), "", _STICKS, side=True)
# what C asks of a kind
TRAITS = ("compliant", "impulsive", "surface", "rubs", "led")
KINDS = {kind.name: kind for kind in (FRICTION, STOP, SWITCH, YIELD, IMPACT, IMPACT_FRICTION, CONE, CONE_SIDE)}
BY_TYPE_NAME = {kind.type_name: kind for kind in KINDS.values()}
