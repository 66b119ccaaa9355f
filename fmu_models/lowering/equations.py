"""What a lowered system says, as equations for people: expressions and the words between them."""

import sympy

from fmu_models.language.contact_dynamics import ContactDynamics
from fmu_models.lowering.hybrid_system import HybridSystem

# text and expressions in turn
Line = tuple[str | sympy.Basic, ...]


def rates(system: HybridSystem) -> list[tuple[sympy.Expr, sympy.Expr]]:
    """Left and right sides of the equations of motion, contact forces named lambda_<contact>.

    Of a map they are its rule. With a mass matrix that is left to the generated code, the left sides are its rows times
    the accelerations.
    """
    if system.rule:
        return [(sympy.Symbol(f"{x.name} (k+1)"), after) for x, after in system.rule.items()]
    forces = sympy.Matrix([sympy.Symbol(f"lambda_{contact.name}") for contact in system.contacts])
    pushed = system.W * forces if system.contacts else sympy.zeros(len(system.driven), 1)
    dots = [sympy.Symbol(f"{state.name}'") for state in system.driven]
    sides: list[tuple[sympy.Expr, sympy.Expr]] = [(sympy.Symbol(f"{q.name}'"), q.v) for q in system.coordinates]
    for i, free in enumerate(system.acceleration):
        row = [m * dots[k] for (j, k), m in sorted(system.inertia.items()) if j == i]
        sides.append((sympy.Add(*row) if system.inertia else dots[i], free + pushed[i]))
    internal = zip(system.internal_states, system.internal_rates, strict=True)
    return sides + [(sympy.Symbol(f"{state.name}'"), rate) for state, rate in internal]


def outputs(system: HybridSystem) -> list[sympy.Basic]:
    """The outputs, from the forces, slip speeds and depths of contacts by the names lambda_, v_ and d_<contact>."""
    named: dict[sympy.Basic, sympy.Basic] = {
        symbol: sympy.Symbol(f"{letter}_{contact.name}")
        for contact in system.contacts
        for letter, symbol in (
            *(("lambda", contact.force_symbol), ("v", contact.slip_symbol)),
            *(("d", contact.depth_symbol), ("s", contact.sign_symbol)),
        )
        if symbol is not None
    }
    for state, rate in zip(system.driven, system.rate_symbols, strict=True):
        named[rate] = sympy.Symbol(f"{state.name}'")
    return [sympy.sympify(output.expression).xreplace(named) for output in system.outputs]


def of_contact(contact: ContactDynamics) -> dict[str, Line]:
    """What a contact is made of, by its kind."""
    named = {
        contact.slip_symbol: sympy.Symbol("v" if not contact.kind.surface else "h"),
        contact.depth_symbol: sympy.Symbol("d"),
        contact.memory_symbol: sympy.Symbol("v0"),
        contact.sign_symbol: sympy.Symbol("s"),
    }
    named = {symbol: letter for symbol, letter in named.items() if symbol is not None}

    def written(expression: sympy.Expr) -> sympy.Basic:
        return sympy.sympify(expression).xreplace(named)

    depth = contact.depth if contact.depth is not None else sympy.S.Zero
    if contact.kind.rubs:
        lines: dict[str, Line] = {"v, slip speed": (contact.slip,), "lambda in slip": (written(contact.force),)}
        if contact.sticks:
            minus = contact.capacity_minus
            limit: Line = ("|lambda| < ", contact.capacity)
            for state, value in contact.reset.items():
                lines[f"{state.name} where stick begins or ends"] = (written(value),)
            lines["sticks while"] = limit if minus is None else (-minus, " < lambda < ", contact.capacity)
        if contact.depth is not None:
            lines["present where"] = (contact.depth, " >= 0")
        return lines
    if contact.kind.side:
        return {"v, slip speed": (contact.slip,), "lambda": ("against the slip, of all; in stick what holds it",)}
    if contact.kind.compliant:
        ends = "gap" if contact.release is None else "force"
        lines = {"d, depth": (depth,), "v, its rate": (contact.slip,)}
        return lines | {"lambda while touching": (written(contact.force),), "lets go": (f"where its {ends} vanishes",)}
    if contact.kind.impulsive:
        rule = "Poisson, " if contact.poisson else "Newton, "
        lines = {"gap": (-depth,), "v, its rate": (contact.slip,), "restitution": (rule, contact.restitution)}
        return lines | {"closed while": ("lambda, the normal force, is positive",)}
    if contact.kind.led:
        law: Line = (contact.friction, " times the normal force; in stick less than that")
        return {"v, slip speed": (contact.slip,), "|lambda| in slip": law}
    slides = "where both flows push onto h = 0" if contact.sticks else "never: the flow goes through h = 0"
    lines = {"h, switching function": (contact.slip,), "slides": (slides,)}
    if contact.reset:
        jumps = [(f"{state.name} := ", written(value)) for state, value in contact.reset.items()]
        lines["jump at h = 0"] = tuple(item for i, jump in enumerate(jumps) for item in (*(["; "] * (i > 0)), *jump))
    return lines


def states_of(contact: ContactDynamics) -> list[str]:
    """The states that a contact can have, in words."""
    return [contact.kind.state_words[state] for state in contact.states]
