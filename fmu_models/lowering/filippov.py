"""Automata in factored form: which switches slide, and the flow along them.

    f = f0 + sum_i s_i f_i
    sliding switch:  W_i = -f_i, lambda = -s_i, capacity 1: |lambda| < 1 keeps h_i = 0
    other switch:    s_i f_i stays in a

In slip lambda = -s_i gives a + W lambda = f0 + s_i f_i; in stick lambda takes the value between -1 and 1 that keeps
h_i' = 0, which is Filippov's convex mean of the two flows. A switch cannot slide, and its sign stays where it is, if
the flow is continuous across it (f_i = 0 where h_i = 0) or crosses it alike on both sides (grad h_i f_i = 0).

A reset whose jump vanishes with h' = L h, the rate of h, may end in rest: infinitely many in finite time, and then
h = h' = 0. What holds it there keeps h'' = 0, so that G has grad h' in the place of grad h:
    reset from both sides, flow jumps:    W_i = -f_i as above; it rests while both flows push back
reset from one, flow knows no sign:   W along the jump, grad h' W = 1, lambda >= 0 from h > 0 (<= 0 from below) without
                                      a bound that matters: 2 n times the root of the squares of the n terms of h''

Of two switches, one on h and one on h', with h'' < 0 for h > 0 and > 0 for h < 0, infinitely many crossings may end in
finite time at h = h' = 0 (second-order sliding). The first rests there, like a reset from both sides; the other slides.

Sources: Filippov, Differential equations with discontinuous right-hand sides (1988), section 2.4; Levant, International
Journal of Control 58 (1993) 1247-1263 (sliding order).
"""

from typing import Any

import sympy

from fmu_models.language.automaton import Automaton, Switch
from fmu_models.language.contact_dynamics import ContactDynamics, multiplied_out, terms
from fmu_models.language.contact_kinds import SWITCH
from fmu_models.language.declaration import Output
from fmu_models.language.quantities import TIME, Parameter
from fmu_models.lowering.hybrid_system import HybridSystem, only_parameters


def lower_automaton(automaton: Automaton) -> HybridSystem:
    """Separate what the signs multiply and derive the sliding dynamics."""
    states, switches = list(automaton.states), list(automaton.switches)
    flow = sympy.Matrix([automaton.flows[x] for x in states])
    jumps = [flow.applyfunc(lambda f, sign=switch.sign: multiplied_out(sympy.diff(f, sign))) for switch in switches]
    rates = [_resting_rate(automaton, switch, jump) for switch, jump in zip(switches, jumps, strict=True)]
    slides = [
        bool(rate) or _slides(automaton, switch, jump)
        for switch, jump, rate in zip(switches, jumps, rates, strict=True)
    ]
    free = flow.xreplace({s.sign: sympy.S.Zero for s, sliding in zip(switches, slides, strict=True) if sliding})
    columns = [-jump if sliding else 0 * jump for jump, sliding in zip(jumps, slides, strict=True)]
    for i, rate in enumerate(rates):
        if rate and not any(jumps[i].flat()):
            columns[i] = _support(automaton, switches[i], rate)
    W = sympy.Matrix.hstack(sympy.zeros(len(states), 0), *columns)
    held = [rate or switch.function for switch, rate in zip(switches, rates, strict=True)]
    gradient = sympy.Matrix([[sympy.diff(function, x) for x in states] for function in held])
    G = gradient.reshape(len(switches), len(states)) * W
    return HybridSystem.of(
        automaton,
        driven=tuple(states),
        rate_symbols=tuple(x.rate for x in states),
        acceleration=tuple(free),
        W=sympy.ImmutableSparseMatrix(W),
        G=sympy.ImmutableSparseMatrix(G),
        contacts=tuple(
            _switch_dynamics(automaton, s, sliding, rate)
            for s, sliding, rate in zip(switches, slides, rates, strict=True)
        ),
        outputs=tuple(Output(o.name, sympy.sympify(o.expression), o.unit, o.description) for o in automaton.outputs),
    )


def _slides(automaton: Automaton, switch: Switch, jump: sympy.Matrix) -> bool:
    """Whether the flow jumps across h = 0 in a way that could hold the motion there."""
    function = sympy.sympify(switch.function)
    entries: list[Any] = [jump[i, 0] for i in range(jump.rows)]
    normal = sum((sympy.diff(function, x) * f for x, f in zip(automaton.states, entries, strict=True)), sympy.S.Zero)
    return sympy.simplify(normal) != 0 and not all(_vanishes(f, function, automaton) for f in entries)


def _vanishes(expression: sympy.Expr, function: sympy.Expr, automaton: Automaton) -> bool:
    """Whether an expression is zero wherever the function is: it is put in place of a quantity in which h is affine."""
    for symbol in (*automaton.states, *automaton.all_inputs):
        slope = sympy.diff(function, symbol)
        if slope != 0 and not slope.has(symbol):
            on_surface = symbol - function / slope
            return sympy.simplify(expression.subs(symbol, sympy.expand(on_surface))) == 0
    quotient = sympy.cancel(expression / function)
    return not sympy.denom(quotient).free_symbols & function.free_symbols


def _rate(automaton: Automaton, function: sympy.Expr) -> sympy.Expr:
    """The time derivative of a function, from the rates of states and inputs."""
    moving = (*automaton.states, *automaton.all_inputs)
    return sum((sympy.diff(function, x) * x.rate for x in moving), sympy.diff(function, TIME))


def _along_flow(automaton: Automaton, rate: sympy.Expr) -> sympy.Expr:
    return rate.xreplace({x.rate: automaton.flows[x] for x in automaton.states})  # pyright: ignore[reportReturnType]


def _jump(automaton: Automaton, switch: Switch) -> sympy.Matrix:
    """What a reset adds to the states."""
    to = {x: e for reset in automaton.resets if reset.switch == switch for x, e in reset.to.items()}
    return sympy.Matrix([to.get(x, x) - x for x in automaton.states])


def _gradient(automaton: Automaton, function: sympy.Expr) -> sympy.Matrix:
    return sympy.Matrix([[sympy.diff(function, x) for x in automaton.states]])


def _resting_rate(automaton: Automaton, switch: Switch, jump: sympy.Matrix) -> sympy.Expr | None:
    """h' of a switch that may come to rest, by its reset or by the switch on h' beside it; None of any other."""
    sides = [reset.bits for reset in automaton.resets if reset.switch == switch]
    rate = _along_flow(automaton, _rate(automaton, sympy.sympify(switch.function)))
    if rate.has(*(s.sign for s in automaton.switches)) or not rate.has(*automaton.states):
        return None
    if not all(_vanishes(entry, rate, automaton) for entry in _jump(automaton, switch).flat()):
        return None
    pushes = sympy.simplify((_gradient(automaton, rate) * jump)[0]) != 0
    others = (sympy.sympify(s.function) for s in automaton.switches if s != switch)
    if not sides and not any(_vanishes(rate, function, automaton) for function in others):
        return None
    return rate if (pushes if sides in ([], [3]) else not any(jump.flat())) else None


def _support(automaton: Automaton, switch: Switch, rate: sympy.Expr) -> sympy.Matrix:
    """The direction in which a surface holds what its resets bring to rest: h'' changes by 1."""
    direction = _jump(automaton, switch).applyfunc(lambda entry: sympy.cancel(entry / rate))
    return (direction / (_gradient(automaton, rate) * direction)[0]).applyfunc(sympy.cancel)


def _strength(automaton: Automaton, bend: sympy.Expr, sense: int) -> sympy.Expr:
    """More than a surface needs to hold what h'' would be without it; it stays where that falls to 0."""
    parts = terms(_along_flow(automaton, bend))
    if len(parts) == 1 and only_parameters(parts):
        return -2 * sense * parts[0]
    moving = {e for part in parts for e in (*part.atoms(sympy.Function), *part.free_symbols)}
    whole: dict[Any, Any] = {e: sympy.S.One for e in moving if not isinstance(e, Parameter)}
    sizes = [*parts, *(part.xreplace(whole) for part in parts)]
    return 2 * len(parts) * sympy.sqrt(sympy.Add(*(size * size for size in sizes)))


def _switch_dynamics(
    automaton: Automaton, switch: Switch, slides: bool, resting_rate: sympy.Expr | None
) -> ContactDynamics:
    function = sympy.sympify(switch.function)
    resets = [reset for reset in automaton.resets if reset.switch == switch]
    side = resets[0].bits if resets else 0
    bend = _rate(automaton, resting_rate or function)
    capacity, capacity_minus = sympy.S.One, None
    if resting_rate and side in (1, 2):
        strength = _strength(automaton, bend, 1 if side == 1 else -1)
        capacity, capacity_minus = (strength, sympy.S.Zero) if side == 1 else (sympy.S.Zero, strength)
    return ContactDynamics(
        name=switch.name,
        description=switch.description,
        kind=SWITCH,
        slip=function,
        slip_rate=bend,
        slip_terms=terms(function),
        capacity=capacity,
        capacity_minus=capacity_minus,
        force=-switch.sign if slides and capacity_minus is None else sympy.S.Zero,
        sticks=slides,
        reset={x: sympy.sympify(e) for reset in resets for x, e in reset.to.items()},
        reset_sides=side | (8 if resting_rate else 0),
        force_symbol=switch.force,
        slip_symbol=switch.value,
        sign_symbol=switch.sign,
    )
