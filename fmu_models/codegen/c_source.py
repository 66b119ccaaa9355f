"""The C of one model: what implements engine/model/model.h, ``model_variation.c`` for engine/tangents/variation.h and
``model_discs.c`` for engine/step/reach.h.

The text depends on the declaration alone: it is the same, byte for byte, in every process.
"""

import uuid
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from typing import Any

import sympy

from fmu_models.codegen.c_expression import c_expression, c_number, c_string
from fmu_models.codegen.c_function import DISC, SERIES, VARIATION, FunctionKind, by_case, split, table
from fmu_models.codegen.constants import Constants
from fmu_models.codegen.discs import states_read
from fmu_models.codegen.inertia import assign_inertia, solve
from fmu_models.codegen.jets import Recurrences, Slots
from fmu_models.codegen.map_rule import rule_functions
from fmu_models.codegen.tables import facts, head_of, legend, sizes_of
from fmu_models.codegen.variations import read_by
from fmu_models.language.contact_dynamics import ContactDynamics, terms
from fmu_models.language.quantities import TIME
from fmu_models.language.values import bounds
from fmu_models.lowering.hybrid_system import HybridSystem, acting, elements_of

_NAMESPACE = uuid.uuid5(uuid.NAMESPACE_URL, "stickslip:model")


def sources(system: HybridSystem) -> dict[str, str]:
    """Text of ``model.c``, ``model_kind.c`` (what exists per kind of number), ``model_variation.c``, ``model_discs.c``,
    ``model_sizes.h``. StickslipError: an expression of the model cannot be turned into Taylor recurrences."""
    return dict(_sources(system))


@lru_cache(maxsize=8)
def _sources(system: HybridSystem) -> dict[str, str]:
    names = _Names(system)
    functions, variations, discs = _functions(system, names)
    guards = [
        _violation(system, names),
        *(_magnitude(system, names, quantity) for quantity in ("slip", "depth", "rate")),
        _lever(system, names),
        _kinetic_energy(system),
    ]
    # the constants in d are collected while the other functions are made
    arithmetic = [*functions, _reset(system, names), *_coefficients(system, names), _signals(system, names)]
    arithmetic.insert(0, _prepare(system, names))
    head = head_of(system) + legend(system)
    model = "\n".join(
        [
            head + '#include "model/model.h"\n\n#include <float.h>\n#include <math.h>\n#include <stddef.h>\n',
            *facts(system, names.slots),
            *guards,
            rule_functions(system),
        ]
    )
    model += '\n#include "model/jets.h"\n#include "model/mass_matrix.h"\n#include "model_kind.c"\n'
    kind = "\n".join([head + "/* included once per kind of number: model_kind.h */\n", *arithmetic])
    variation = "\n".join([head + "/* included by tangents/variation.c */\n", *variations])
    disc = "\n".join([head + "/* included by step/reach.c */\n", *discs])
    derived = len(names.constants.derived) + 2 * len(elements_of(system))
    sizes = sizes_of(system, derived, names.slots, reach=bool(discs))
    quantities = (*system.parameters, *system.all_inputs, *system.states, *system.outputs)
    variables = "\n".join(f"{q.name} {q.unit} {q.description}" for q in quantities)
    # identifies model and variables: guid of FMI 2, instantiationToken of FMI 3
    token = f"{{{uuid.uuid5(_NAMESPACE, model + kind + sizes + variables)}}}"
    texts = {"model.c": model, "model_kind.c": kind, "model_variation.c": variation, "model_discs.c": disc}
    return texts | {"model_sizes.h": sizes.replace("@TOKEN@", token)}


class _Names:
    """The C names of all quantities of the model."""

    def __init__(self, system: HybridSystem) -> None:
        self.parameters: dict[sympy.Basic, str] = {q: f"p[{i}]" for i, q in enumerate(system.parameters)}
        self.inputs: dict[sympy.Basic, str] = {q: f"j->u[{i}]" for i, q in enumerate(system.all_inputs)}
        self.states: dict[sympy.Basic, str] = {q: f"j->x[{i}]" for i, q in enumerate(system.states)}
        rates: dict[sympy.Basic, str] = {q.rate: f"j->du[{i}]" for i, q in enumerate(system.all_inputs)}
        piles = {c.pile_symbol: f"j->pile[{i}]" for i, c in enumerate(system.contacts) if c.pile_symbol is not None}
        self.free = {TIME: "j->t", **self.inputs, **rates, **self.states, **piles}
        self.first = {**self.parameters, **{q: f"{name}[0]" for q, name in self.free.items()}}
        self.accelerations: dict[sympy.Basic, str] = {a: f"j->a[{i}]" for i, a in enumerate(system.rate_symbols)}
        # what outputs read of the rates of driven states: these are without contact forces
        self.free_rates: dict[Any, sympy.Basic] = {a: sympy.Dummy(f"{a}_free", real=True) for a in system.rate_symbols}
        constants: dict[sympy.Basic, str] = {}
        self.slips: dict[sympy.Basic, str] = {}
        self.depths: dict[sympy.Basic, str] = {}
        self.sides: set[sympy.Basic] = set()  # of switches by whose root laws go: positive
        for i, c in enumerate(system.contacts):
            constants[c.sign_symbol] = f"j->sign[{i}]"
            if c.memory_symbol is not None:
                constants[c.memory_symbol] = f"j->memory[{i}]"
            if c.depth_symbol is not None:
                self.depths[c.depth_symbol] = f"j->depth[{i}]"
            if c.rooted and c.kind.surface:
                self.sides.add(c.sign_symbol * c.slip)
            self.slips |= {c.slip_symbol: f"j->slip[{i}]", c.slip: f"j->slip[{i}]"}
        # with a mass matrix that is factored, W has no expressions
        self.W: dict[sympy.Basic, str] = {
            sympy.Dummy(f"W_{i}_{c}", real=True): f"j->W[{i}][{c}]" for i, c in acting(system) if system.inertia
        }
        self.forces: dict[sympy.Basic, str] = {c.force_symbol: f"j->force[{i}]" for i, c in enumerate(system.contacts)}
        self.constants = Constants(self.parameters, constants)
        self.slots = Slots(moving=not system.constant_inertia)

    def recurrences(self, *series: Mapping[sympy.Basic, str]) -> Recurrences:
        """A function body that may read these series besides time, inputs and states."""
        symbols = dict(self.free)
        for addition in series:
            symbols |= addition
        return Recurrences(symbols, self.constants, self.slots, rooted={*self.depths, *self.sides})


def _functions(system: HybridSystem, names: _Names) -> tuple[list[str], list[str], list[str]]:
    """The functions of model.h that work on series, their variations and their discs."""
    contacts = list(enumerate(system.contacts))
    gaps = names.slips, names.depths
    moving = names.slips, names.accelerations
    depths = {f"j->depth[{i}]": c.depth for i, c in contacts if c.depth is not None}
    forces = [{} if c.kind.rigid else {f"j->force[{i}]": c.force} for i, c in contacts]
    releases = [{} if c.release is None else {f"j->release[{i}]": c.release} for i, c in contacts]
    sticks = [_stick(system, i, c) for i, c in contacts]
    elements = len(elements_of(system))
    rates = system.internal_rates[: len(system.internal_rates) - elements]
    internal = {f"j->zrate[{i}]": rate for i, rate in enumerate(rates)}
    accelerations = {f"j->a[{i}]": a for i, a in enumerate(system.acceleration)}

    free_rates: dict[sympy.Basic, str] = {names.free_rates[a]: name for a, name in names.accelerations.items()}

    def recurrences(
        assignments: Mapping[str, sympy.Expr], *series: Mapping[sympy.Basic, str], after: Iterable[Recurrences] = ()
    ) -> Recurrences:
        result = names.recurrences(*series)
        for earlier in after:
            result.share(earlier)
        for target, expression in assignments.items():
            result.assign(target, expression)
        return result

    inertia = assign_inertia(system, names.recurrences(names.W), names.W)
    acceleration = recurrences(accelerations, after=[inertia])
    derived = [inertia, acceleration]
    if system.inertia:
        solve(acceleration, "a[0]", "a")

    # what laws read first: whether it is seen
    slip = recurrences({f"j->slip[{i}]": c.slip for i, c in contacts if not c.elements and not c.kind.cone})
    for i in (i for i, c in contacts if c.elements):
        slip.lines.append(f"KIND(elements_series)(d, j, {i}, k);")
        slip.variations.state(f"elements_variation(d, j, l, {i}, k);")
    depth = recurrences(depths)
    # of a cone as far as its own terms tell
    names.slots.seen |= {f"j->slip[{i}]" for i, c in contacts if c.kind.cone or c.elements}
    laws = [recurrences(force, *gaps) for force in forces]
    # these laws are asked for at every order: their contacts neither stick nor leave nor are rigid
    always = [laws[i] for i, c in contacts if c.kind.rubs and not c.sticks and c.depth is None]

    functions: dict[str, Recurrences | list[Recurrences]] = {
        "slip": slip,
        "depth": depth,
        "inertia": inertia,
        "acceleration": acceleration,
        "law": laws,
        "release": [recurrences(release, *gaps) for release in releases],
        "stick": [recurrences(stick, *moving, after=derived) for stick in sticks],
        "internal": recurrences(internal, *gaps, after=[*derived, *always]),
    }
    names.slots.freeze()
    outputs = recurrences(_outputs(system, names), *gaps, names.forces, names.W, free_rates, after=derived)
    lengths = [
        f"if (j->rising[{i}] != 1) j->slip[{i}][k] = jet_length(j->slip[{i}], j->slip[{i + 1}], j->slip[{i + 2}], k);"
        for i, c in contacts
        if c.kind.cone
    ]
    texts = [
        *_texts(SERIES, functions, lambda body: body.lines + lengths * (body is slip)),
        SERIES.function("model_outputs", outputs.lines),
    ]
    return texts, _variations(functions), _discs(system, names, functions)


def _stick(system: HybridSystem, i: int, contact: ContactDynamics) -> dict[str, sympy.Expr]:
    """What stick needs of contact ``i``: its slip rate and its capacity."""
    values = {f"j->slip_rate[{i}]": contact.slip_rate, f"j->capacity[{i}]": contact.capacity}
    return values | ({f"j->capacity_minus[{i}]": contact.capacities[1]} if system.directed else {})


def _variations(functions: Mapping[str, Recurrences | list[Recurrences]]) -> list[str]:
    """The functions of model_variation.c."""
    read = read_by(body.variations.lines for body in _bodies(functions.values()))
    return _texts(VARIATION, functions, lambda body: body.variations.statements(read))


def _texts(
    kind: FunctionKind,
    functions: Mapping[str, Recurrences | list[Recurrences]],
    lines: Callable[[Recurrences], list[str]],
) -> list[str]:
    """The functions of one kind from the lines of each body."""
    return [
        kind.by_contact(name, list(map(lines, bodies)))
        if isinstance(bodies, list)
        else kind.function(f"model_{name}", lines(bodies))
        for name, bodies in functions.items()
    ]


def _bodies(functions: Iterable[Recurrences | list[Recurrences]]) -> list[Recurrences]:
    return [body for bodies in functions for body in (bodies if isinstance(bodies, list) else [bodies])]


def _discs(system: HybridSystem, names: _Names, functions: Mapping[str, Recurrences | list[Recurrences]]) -> list[str]:
    """The functions of model_discs.c and what is not seen of each; nothing where all is."""
    functions = {name: bodies for name, bodies in functions.items() if name != "inertia" or not system.constant_inertia}
    bodies = _bodies(functions.values())
    if not any(body.discs.unseen for body in bodies):
        return []
    read = read_by(body.discs.lines for body in bodies)
    reads = states_read(text for body in bodies for text in body.discs.statements(read))

    def flags(name: str, size: str, values: Iterable[bool]) -> str:
        return table("static const unsigned char", name, f"MODEL_ROOM({size})", map(int, values))

    def by_name(name: str) -> list[Recurrences]:
        return _bodies([functions[name]])

    contacts = range(len(system.contacts))
    unseen = {
        **{name: [f"j->{name}[{i}]" not in names.slots.seen for i in contacts] for name in ("slip", "depth")},
        **{name: [body.discs.unseen for body in by_name(name)] for name in ("law", "release", "stick")},
    }
    rates = any(body.discs.unseen for name in ("acceleration", "internal") for body in by_name(name))
    return [
        flags("disc_states", "MODEL_NX", (i in reads for i in range(len(system.states)))),
        *(flags(f"{name}_unseen", "MODEL_NC", values) for name, values in unseen.items()),
        f"enum {{ MODEL_RATES_UNSEEN = {int(rates)} }};\n",
        *_texts(DISC, functions, lambda body: body.discs.statements(read)),
    ]


def _outputs(system: HybridSystem, names: _Names) -> dict[str, Any]:
    """Outputs, with every acceleration written as what it is without and with contact forces."""
    symbols = {name: symbol for symbol, name in names.W.items()}
    pushed: list[list[Any]] = [[] for _ in system.driven]
    for i, c in sorted(acting(system)):
        entry = symbols[f"j->W[{i}][{c}]"] if system.inertia else system.W[i, c]
        pushed[i].append(entry * system.contacts[c].force_symbol)
    full = {
        a: names.free_rates[a] + sympy.Add(*by_force) for a, by_force in zip(system.rate_symbols, pushed, strict=True)
    }
    return {f"j->y[{i}]": sympy.sympify(output.expression).xreplace(full) for i, output in enumerate(system.outputs)}


def _prepare(system: HybridSystem, names: _Names) -> str:
    derived = names.constants.derived
    array = [*(e.stiffness for e in elements_of(system)), *(e.bound for e in elements_of(system))]
    rows = [(name, value) for value, name in derived.items()]
    rows += [(f"d[{n}]", value) for n, value in enumerate(array, len(derived))]
    lines = [f"{name} = {c_expression(sympy.sympify(value), names.parameters)};" for name, value in rows]
    return split("model_prepare", lines, "void model_prepare(const Real *p, Real *d)")


def _violation(system: HybridSystem, names: _Names) -> str:
    """Comparisons are written so that NaN violates them."""
    tests = []
    for parameter, name in zip(system.parameters, names.parameters.values(), strict=True):
        unit = "" if parameter.unit == "1" else f" {parameter.unit}"
        finite = f"{parameter.name} must be a finite number ({parameter.description})"
        tests.append((f"isfinite({name})", finite))
        for relation, bound in bounds(parameter):
            sentence = f"{parameter.name} must be {relation} {bound:g}{unit} ({parameter.description})"
            tests.append((f"{name} {relation} {c_number(bound)}", sentence))
    for requirement in system.all_requirements:
        relation = ">" if requirement.strict else ">="
        value = c_expression(sympy.sympify(requirement.expression), names.parameters)
        tests.append((f"{value} {relation} 0.0", requirement.sentence))
    lines = [f"    if (!({test})) {{\n        return {c_string(sentence)};\n    }}" for test, sentence in tests]
    body = "\n".join(["    (void)p;", *lines, "    return NULL;"])
    return f"const char *model_violation(const double *p)\n{{\n{body}\n}}\n"


def _magnitude(system: HybridSystem, names: _Names, quantity: str) -> str:
    """The sum of the magnitudes of the terms of every slip speed, depth or rate of slip."""
    values = names.first | {a: f"{name}[0]" for a, name in names.accelerations.items()}
    accelerations = {} if system.inertia else dict(zip(system.rate_symbols, system.acceleration, strict=True))
    cases = []
    for i, contact in enumerate(system.contacts):
        summands = {"slip": contact.slip_terms, "depth": contact.depth_terms, "rate": ()}[quantity]
        if quantity == "rate" and (contact.kind.rigid or contact.kind.yields):
            summands = (contact.slip_rate.xreplace(accelerations),)
        if contact.elements and quantity == "slip":
            cases.append(f"    case {i}: return element_bound(d, {i})[0] + fabs(j->slip[{i}][0]);\n")
        elif summands:
            total = " + ".join(_magnitude_of(term, values) for term in summands)
            cases.append(f"    case {i}: return {total};\n")
    head = f"double model_{quantity}_magnitude(const double *p, const double *d, const Jets *j, int c)"
    return by_case(head, cases, "return 0.0;")


def _lever(system: HybridSystem, names: _Names) -> str:
    """What is left of every lever d slip/dv; of a switch, of the part of its rate that changes with its sign."""
    cases = []
    for i, contact in enumerate(system.contacts):
        slips = [c.slip for c in (system.contacts[i + 1 : i + 3] if contact.kind.cone else [contact])]
        levers = [sympy.diff(slip, v) for slip in slips for v in system.driven if v in slip.free_symbols]
        slopes: list[Any] = [system.G[i, i]] if contact.kind.surface and not system.inertia else levers
        ratios = [_part_left(sympy.sympify(slope), system, names.first) for slope in slopes if slope != 0]
        largest = ratios[0] if ratios else "0.0"
        for ratio in ratios[1:]:
            largest = f"fmax({largest}, {ratio})"
        cases.append(f"    case {i}: return {largest};\n")
    return by_case("double model_lever(const double *p, const double *d, const Jets *j, int c)", cases, "return 0.0;")


def _kinetic_energy(system: HybridSystem) -> str:
    """The part of the kinetic energy that impulses change, at one point."""
    values: dict[Any, str] = {TIME: "at->time"}
    rows = {"p": system.parameters, "u": system.all_inputs, "x": system.states}
    values |= {q: f"at->{letter}[{i}]" for letter, quantities in rows.items() for i, q in enumerate(quantities)}
    values |= {q.rate: f"at->du[{i}]" for i, q in enumerate(system.all_inputs)}
    shared, (energy,) = sympy.cse([system.kinetic_energy], symbols=sympy.numbered_symbols("part", cls=sympy.Dummy))
    values |= {symbol: f"part{i}" for i, (symbol, _) in enumerate(shared)}
    lines = [f"    const double {values[symbol]} = {c_expression(value, values)};\n" for symbol, value in shared]
    body = f"    (void)at;\n{''.join(lines)}    return {c_expression(sympy.sympify(energy), values)};\n"
    return f"double model_kinetic_energy(const Point *at)\n{{\n{body}}}\n"


def _part_left(expression: sympy.Expr, system: HybridSystem, values: Mapping[Any, str]) -> str:
    """An expression in parts of its terms, and of how it would change over the typical magnitudes of the states."""
    if not expression.free_symbols:
        return "1.0"
    scale = [_magnitude_of(term, values) for term in terms(expression)]
    symbols = expression.free_symbols
    for state in system.states:
        slope = sympy.diff(expression, state) if state in symbols else sympy.S.Zero
        if slope != 0:
            magnitude = f"(fabs({values[state]}) + {c_number(state.nominal)})"
            scale += [f"{_magnitude_of(term, values)} * {magnitude}" for term in terms(slope)]
    return f"fabs({c_expression(expression, values)}) / fmax({' + '.join(scale)}, DBL_MIN)"


def _magnitude_of(expression: sympy.Basic, values: Mapping[Any, str]) -> str:
    """The C of an expression without the cancellation in its sums: each is that of the magnitudes of its terms."""
    if isinstance(expression, sympy.Add):
        return "(" + " + ".join(_magnitude_of(term, values) for term in expression.args) + ")"
    if isinstance(expression, sympy.Mul):
        return "*".join(_magnitude_of(factor, values) for factor in expression.args)
    return f"fabs({c_expression(expression, values)})"


def _reset(system: HybridSystem, names: _Names) -> str:
    """The states after a jump, all of them."""
    cases = []
    for i, contact in enumerate(system.contacts):
        if contact.reset and not contact.elements:
            after = [sympy.sympify(contact.reset.get(state, state)) for state in system.states]
            lines = [f"        x[{n}] = {c_expression(value, names.first)};\n" for n, value in enumerate(after)]
            cases.append(f"    case {i}:\n{''.join(lines)}        break;\n")
    return by_case("void model_reset(const Real *p, const Real *d, const Jets *j, int c, Real *x)", cases)


def _coefficients(system: HybridSystem, names: _Names) -> list[str]:
    """Restitution and friction of the rigid contacts."""
    contacts = list(enumerate(system.contacts))
    kinds = {
        "restitution": [(i, c.restitution) for i, c in contacts if c.kind.impulsive],
        "friction": [(i, c.friction) for i, c in contacts if c.kind.led],
    }
    return [
        by_case(
            f"Real model_{kind}(const Real *p, const Real *d, int c)",
            [f"    case {i}: return {names.constants.text(value)};\n" for i, value in values],
            "return 0.0;",
        )
        for kind, values in kinds.items()
    ]


def _signals(system: HybridSystem, names: _Names) -> str:
    """The knots of the periodic signals, and how many there are."""
    cases = []
    for i, signal in enumerate(system.signals):
        values = {"period": signal.period, "start": signal.start}
        for n, (place, value) in enumerate(signal.knots):
            values |= {f"place[{n}]": place, f"value[{n}]": value}
        lines = [f"        s->{name} = {names.constants.text(value)};\n" for name, value in values.items()]
        cases.append(f"    case {i}:\n{''.join(lines)}        return {len(signal.knots)};\n")
    return by_case("int model_signal(const Real *p, const Real *d, int c, Signal *s)", cases, "return 0;")
