"""Automata in factored form: which switches slide, and the flow along them.

    f = f0 + sum_i s_i f_i
    sliding switch:  W_i = -f_i, lambda = -s_i, capacity 1: |lambda| < 1 keeps h_i = 0
    other switch:    s_i f_i stays in a

In slip lambda = -s_i gives a + W lambda = f0 + s_i f_i; in stick lambda takes the value between -1 and 1 that keeps
h_i' = 0, which is Filippov's convex mean of the two flows. A switch cannot slide, and its sign stays where it is, if
the flow is continuous across it (f_i = 0 where h_i = 0) or crosses it alike on both sides (grad h_i f_i = 0).

Source: Filippov, Differential equations with discontinuous right-hand sides (1988), section 2.4.
"""

from __future__ import annotations

from typing import Any

import sympy

from fmu_models.language.automaton import Automaton, Switch
from fmu_models.language.contact_dynamics import ContactDynamics, multiplied_out, terms
from fmu_models.language.contact_kinds import SWITCH
from fmu_models.language.declaration import Output
from fmu_models.language.quantities import TIME
from fmu_models.lowering.hybrid_system import HybridSystem, only_parameters


def lower_automaton(automaton: Automaton) -> HybridSystem:
    """Separate what the signs multiply and derive the sliding dynamics."""
    states, switches = list(automaton.states), list(automaton.switches)
    flow = sympy.Matrix([automaton.flows[x] for x in states])
    jumps = [flow.applyfunc(lambda f, sign=switch.sign: multiplied_out(sympy.diff(f, sign))) for switch in switches]
    slides = [_slides(automaton, switch, jump) for switch, jump in zip(switches, jumps, strict=True)]
    free = flow.xreplace({s.sign: sympy.S.Zero for s, sliding in zip(switches, slides, strict=True) if sliding})
    columns = [-jump if sliding else 0 * jump for jump, sliding in zip(jumps, slides, strict=True)]
    W = sympy.Matrix.hstack(sympy.zeros(len(states), 0), *columns)
    gradient = sympy.Matrix([[sympy.diff(s.function, x) for x in states] for s in switches])
    G = gradient.reshape(len(switches), len(states)) * W
    return HybridSystem(
        name=automaton.name,
        title=automaton.title,
        source=automaton.source,
        parameters=automaton.parameters,
        inputs=automaton.inputs,
        coordinates=(),
        driven=tuple(states),
        rate_symbols=tuple(x.rate for x in states),
        internal_states=(),
        acceleration=tuple(free),
        W=sympy.ImmutableSparseMatrix(W),
        G=sympy.ImmutableSparseMatrix(G),
        constant_inertia=only_parameters([*W, *G]),
        contacts=tuple(_switch_dynamics(automaton, s, sliding) for s, sliding in zip(switches, slides, strict=True)),
        internal_rates=(),
        kinetic_energy=sympy.S.Zero,
        outputs=tuple(Output(o.name, sympy.sympify(o.expression), o.unit, o.description) for o in automaton.outputs),
        all_requirements=automaton.all_requirements,
    )


def _slides(automaton: Automaton, switch: Switch, jump: sympy.Matrix) -> bool:
    """Whether the flow jumps across h = 0 in a way that could hold the motion there."""
    function = sympy.sympify(switch.function)
    entries = [jump[i, 0] for i in range(jump.rows)]
    normal = sum((sympy.diff(function, x) * f for x, f in zip(automaton.states, entries, strict=True)), sympy.S.Zero)
    return sympy.simplify(normal) != 0 and not all(_vanishes(f, function, automaton) for f in entries)


def _vanishes(expression: Any, function: sympy.Expr, automaton: Automaton) -> bool:
    """Whether an expression is zero wherever the function is: it is put in place of a quantity in which h is affine."""
    for symbol in (*automaton.states, *automaton.inputs):
        slope = sympy.diff(function, symbol)
        if slope != 0 and not slope.has(symbol):
            on_surface = symbol - function / slope
            return sympy.simplify(expression.subs(symbol, sympy.expand(on_surface))) == 0
    quotient = sympy.cancel(expression / function)
    return not sympy.denom(quotient).free_symbols & function.free_symbols


def _switch_dynamics(automaton: Automaton, switch: Switch, slides: bool) -> ContactDynamics:
    function = sympy.sympify(switch.function)
    rate = sympy.diff(function, TIME)
    rate += sum((sympy.diff(function, x) * x.rate for x in automaton.states), sympy.S.Zero)
    rate += sum((sympy.diff(function, u) * u.rate for u in automaton.inputs), sympy.S.Zero)
    resets = [reset for reset in automaton.resets if reset.switch == switch]
    return ContactDynamics(
        name=switch.name,
        description=switch.description,
        kind=SWITCH,
        slip=function,
        slip_rate=rate,
        slip_terms=terms(function),
        capacity=sympy.S.One,
        force=-switch.sign if slides else sympy.S.Zero,
        sticks=slides,
        reset={x: sympy.sympify(e) for reset in resets for x, e in reset.to.items()},
        reset_sides=resets[0].bits if resets else 0,
        force_symbol=switch.force,
        slip_symbol=switch.value,
        sign_symbol=switch.sign,
    )
