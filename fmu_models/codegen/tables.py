"""Tables of the generated C: what is known of a model and of its contacts, and how many there are of everything."""

from collections.abc import Iterable, Mapping
from itertools import accumulate
from typing import Any

from fmu_models.codegen.c_expression import c_number, c_string
from fmu_models.codegen.c_function import table
from fmu_models.codegen.inertia import envelope, sparsity
from fmu_models.codegen.jets import Slots
from fmu_models.language import contact_kinds
from fmu_models.lowering.hybrid_system import HybridSystem, elements_of


def head_of(system: HybridSystem) -> str:
    """The first line of every generated file."""
    return f"/* Generated from the declaration of {system.name}; do not edit. */\n"


def facts(system: HybridSystem, slots: Slots) -> list[str]:
    """The arrays of model.h: start values, and what is known of every contact."""

    def numbers(name: str, size: str, values: Iterable[float]) -> str:
        return table("const double", f"start_{name}", f"MODEL_ROOM({size})", map(c_number, values), none="0.0")

    def of_contacts(kind: str, name: str, values: Iterable[Any], none: str = "0") -> str:
        return table(kind, f"contact_{name}", "MODEL_ROOM(MODEL_NC)", values, none)

    tables = {
        "sticks": (c.sticks for c in system.contacts),
        "compliant": (c.kind.compliant for c in system.contacts),
        "bounded": (c.depth is not None for c in system.contacts),
        "releases": (c.release is not None for c in system.contacts),
        "remembers": (c.remembers for c in system.contacts),
        "rooted": (c.rooted for c in system.contacts),
        "resets": (c.reset_sides for c in system.contacts),
        "impulsive": (c.kind.impulsive for c in system.contacts),
        "tangential": (not c.kind.normal and not c.kind.side for c in system.contacts),
        "rubs": (c.kind.rubs for c in system.contacts),
        "cone": (_place_in_cone(system, i) for i in range(len(system.contacts))),
        "poisson": (c.poisson for c in system.contacts),
        "clocks": (sum(contact_kinds.TICK_BITS[name] for name in c.clocks) for c in system.contacts),
    }
    elements = [len(c.elements) for c in system.contacts]
    at = len(system.states) - sum(elements)
    firsts = accumulate([at, *elements[:-1]]) if elements else ()
    partners = (-1 if c.partner is None else c.partner for c in system.contacts)
    return [
        numbers("parameters", "MODEL_NP", (q.value for q in system.parameters)),
        numbers("inputs", "MODEL_NU", (q.value for q in system.all_inputs)),
        numbers("states", "MODEL_NX", (q.start for q in system.states)),
        of_contacts("const char *const", "names", (c_string(c.name) for c in system.contacts), none='""'),
        *(of_contacts("const unsigned char", name, map(int, values)) for name, values in tables.items()),
        of_contacts("const short", "partner", partners, none="-1"),
        of_contacts("const short", "elements", elements),
        of_contacts("const short", "first", firsts),
        *sparsity(system),
        *_harmonics(system, slots),
    ]


# a step by sums of all states beats one by what is not zero; of 8 no longer with derivatives, of 10 not at all
_MOST_LINEAR_STATES = 6


def _is_linear(system: HybridSystem, slots: Slots) -> bool:
    """Whether few states are linear with constant factors in every mode; factors of a memory are others each time."""
    changing = any(c.remembers or c.elements or c.kind.cone for c in system.contacts) or not system.constant_inertia
    return slots.linear and 0 < len(system.states) <= _MOST_LINEAR_STATES and not changing and not system.rule


def _harmonics(system: HybridSystem, slots: Slots) -> list[str]:
    """Which intermediate results are the phase, sine and cosine of each harmonic of a linear system."""
    harmonics = slots.driving if _is_linear(system, slots) else ()
    numbers = [[name.removeprefix("j->w[").removesuffix("]") for name in names] for names in harmonics]
    columns = zip(*numbers, strict=True) if numbers else ((),) * 3
    return [
        table("const short", name, "MODEL_ROOM(MODEL_NH)", column)
        for name, column in zip(("angle", "sine", "cosine"), columns, strict=True)
    ]


def _place_in_cone(system: HybridSystem, i: int) -> int:
    """1 of a cone, 2 and 3 of its sides, which stand behind it; 0 of others."""
    return 1 + next(n for n in range(3) if system.contacts[i - n].kind.cone) if _is_conic(system, i) else 0


def _is_conic(system: HybridSystem, i: int) -> bool:
    return system.contacts[i].kind.cone or system.contacts[i].kind.side


def sizes_of(system: HybridSystem, derived: int, slots: Slots, *, reach: bool) -> str:
    """model_sizes.h, whose token is still to be put in; ``derived``: how many constants follow from the parameters."""
    sizes = {
        "NQ": len(system.coordinates),
        "NV": len(system.driven),
        "NZ": len(system.internal_states),
        "NE": len(elements_of(system)),
        "NC": len(system.contacts),
        "NI": system.indicator_count,
        "NP": len(system.parameters),
        "NU": len(system.all_inputs),
        "NS": len(system.signals),
        "NK": max((len(signal.knots) for signal in system.signals), default=0),
        "NY": len(system.outputs),
        "ND": derived,
        "NW": slots.used,
        "NR": slots.reciprocals,
        "NH": len(slots.driving) if _is_linear(system, slots) else 0,
        "NM": len(envelope(system)),
        "CONSTANT_INERTIA": int(system.constant_inertia),
        "BOUNDED": int(any(contact.depth is not None for contact in system.contacts)),
        "DIRECTED": int(system.directed),
        "YIELDS": int(any(contact.kind.yields for contact in system.contacts)),
        "RESTS": int(any(contact.reset_sides & 8 for contact in system.contacts)),
        "IS_MAP": int(bool(system.rule)),
        "REACH": int(reach),
        "LINEAR": int(_is_linear(system, slots)),
        "RELEASES": int(any(contact.release is not None for contact in system.contacts)),
        "IMPACTS": sum(contact.kind.impulsive for contact in system.contacts),
        "CONES": sum(contact.kind.cone for contact in system.contacts),
    }
    lines = [f'#define MODEL_NAME "{system.name}"', '#define MODEL_TOKEN "@TOKEN@"']
    lines += [f"#define MODEL_{name} {value}" for name, value in sizes.items()]
    lines += ["", "/* states of a contact, and the ticks of its clocks: language/contact_kinds.py */"]
    lines.append(_enumeration("ContactState", "CONTACT", contact_kinds.STATES))
    lines.append(_enumeration("Tick", "TICK", contact_kinds.TICK_BITS))
    body = "\n".join(lines)
    guard = "STICKSLIP_MODEL_SIZES_H"
    return f"{head_of(system)}#ifndef {guard}\n#define {guard}\n\n{body}\n\n#endif\n"


def _enumeration(name: str, prefix: str, values: Mapping[str, int]) -> str:
    return f"typedef enum {{ {', '.join(f'{prefix}_{key.upper()} = {n}' for key, n in values.items())} }} {name};"


def legend(system: HybridSystem) -> str:
    """A comment that says which quantity is which index."""
    rows = {"p": system.parameters, "u": system.all_inputs, "x": system.states, "y": system.outputs}
    lines = [
        f" * {letter}: " + ", ".join(q.name for q in quantities) for letter, quantities in rows.items() if quantities
    ]
    lines += [f" * slip of {c.name}: {c.slip}" for c in system.contacts]
    return "\n".join(["/*", *lines, " */", ""])
