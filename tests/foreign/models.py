"""Small FMUs written by hand, as somebody else would; ``models/`` has one C file for each. FMI 1, 2 and 3 of all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from build import build

from fmu_models.fmu.fmu import Fmu

Models = Callable[[str], Fmu]
FOLDER = Path(__file__).parent / "models"
# options by how the name of a model begins: the order of calls by which it computes; what it cannot do is a warning
ORDERS = {"lazy": ("-DLAZY",), "hasty": ("-DHASTY",), "warning": ("-DFAILED_STATUS=1",)}


@dataclass(frozen=True)
class Foreign:
    """What the description of a model says: names of states, parameters and whole numbers with their start values."""

    states: Sequence[str]
    starts: Sequence[float]
    parameters: Sequence[tuple[str, float]] = ()
    numbers: Sequence[str] = ()
    indicators: int = 0
    inputs: Sequence[str] = ()  # of the parameters: these are inputs
    depends: Sequence[int] = (1,)  # state on which each indicator depends, from 1
    completes: bool = False
    directional: bool = False
    co_simulation: bool = False  # and no Model Exchange
    any_step: bool = True
    saves: bool = False  # gives and takes its state, in FMI 2
    experiment: Mapping[str, str] = field(default_factory=dict)  # that it suggests
    echoes: Sequence[str] = ()  # outputs that are the derivatives, in their order
    rates_depend: Sequence[Sequence[int]] = ()  # states on which each derivative is said to depend, from 1
    first_rate: int = 101  # value reference of the first derivative
    options: Sequence[str] = ()  # of the compiler


INTEGERS = Foreign(("x",), (0.25,), (("u", 1.0), ("last", 1e9)), ("count", "steps"), inputs=("u",), co_simulation=True)
FORCED = Foreign(("x", "v"), (1.0, 0.0), (("d", 0.1), ("f", 0.5), ("omega", 1.3)), directional=True)
BALL = Foreign(("h", "v"), (1.0, 0.0), (("g", 9.81), ("e", 0.7)), ("bounces",), indicators=1)
BLOCK = Foreign(("x", "v"), (0.0, 0.0), (("mu", 1.0), ("belt", 0.5)), ("side",), indicators=1, depends=(2,))
PULSE = Foreign(("x",), (0.0,), (("at", 7.3), ("width", 1e-3)), ("on",), indicators=1)


def heat(n: int = 40, reach: int = 1) -> Foreign:
    """The rod of heat.c, where each cell is said to depend on those up to ``reach`` cells away."""
    place = [7 * k % n for k in range(n)]
    depends: list[list[int]] = [[]] * n
    for k in range(n):
        depends[place[k]] = sorted(place[i] + 1 for i in range(max(0, k - reach), min(n, k + reach + 1)))
    return Foreign(_numbered(n), (0.0,) * n, (("rate", 1e4),), rates_depend=depends)


def _numbered(n: int) -> tuple[str, ...]:
    return tuple(f"x{i}" for i in range(n))


# begins with lazy: it computes when it is asked for its rates, and of all else says what it was before; with hasty: it
# computes when it is asked for a variable, unless it was asked for its rates before
MODELS = {
    "van_der_pol": Foreign(("x", "v"), (2.0, 0.0), (("mu", 1.0),), directional=True),
    "dahlquist": Foreign(("x",), (1.0,), (("k", 1.0),)),
    "robertson": Foreign(("a", "b", "c"), (1.0, 0.0, 0.0)),
    "ball": BALL,
    "lazy_ball": replace(BALL, echoes=("speed", "acceleration")),
    "hasty_ball": replace(BALL, echoes=("speed", "acceleration")),
    # ball.c as tools write it: an edge of h < 0, remembered between events
    "ball_edge": Foreign(("h", "v"), (1.0, 0.0), (("g", 9.81), ("e", 0.7)), ("bounces", "below"), indicators=1),
    # an indicator that is +1 or -1
    "ball_sign": Foreign(("h", "v"), (1.0, 0.0), (("g", 9.81), ("e", 0.7)), ("bounces",), indicators=1),
    # ball.c that rolls on
    "ball_rolling": Foreign(("h", "v", "s"), (1.0, 0.0, 0.0), (("g", 9.81), ("e", 0.7)), ("bounces",), indicators=1),
    "ball_rest": Foreign(("h", "v"), (1.0, 0.0), (("g", 9.81), ("e", 0.7)), ("bounces",), indicators=1),
    "relay": Foreign(("x",), (1.0,), (("a", 0.3),), ("side",), indicators=1),
    "silent_relay": Foreign(("x",), (1.0,), (("a", 0.3),)),
    "circle": Foreign(("x", "y"), (2.0, 0.0), (("omega", 2.0),), ("side",), indicators=1),
    "block": BLOCK,
    "lazy_block": replace(BLOCK, echoes=("speed", "acceleration")),
    "hasty_block": replace(BLOCK, echoes=("speed", "acceleration")),
    "corner": Foreign(("x", "y"), (1.0, 2.0), (), ("side_x", "side_y"), indicators=2, depends=(1, 2)),
    "bar": Foreign(
        ("y", "v", "w"),
        (0.0, 1.0, 0.3),
        (("mu_1", 1.0), ("mu_2", 0.5), ("pull", 0.8), ("twist", 0.1), ("arm", 1.0)),
        ("side_1", "side_2"),
        indicators=2,
        depends=(2, 3),
    ),
    "cross": Foreign(("x", "y", "w"), (0.3, 0.2, 0.0), (), ("side_x", "side_y"), indicators=2, depends=(1, 2)),
    "hook": Foreign(("x", "y"), (1.0, 2.0), (), ("side_x", "nudges"), indicators=2, depends=(1, 2)),
    "relays": Foreign(
        ("a", "b", "c", "d", "e"), (1.0, 2.0, 3.0, 4.0, 5.0), (), (), indicators=5, depends=(1, 2, 3, 4, 5)
    ),
    "heat": heat(),
    "heat_silent": replace(heat(), rates_depend=()),
    "heat_wrong": heat(reach=0),
    "heat_exact": replace(heat(), directional=True),
    "heat_ordered": replace(heat(), rates_depend=(), options=("-DSTRIDE=1",)),
    "heat_1000": replace(heat(1000), parameters=(), first_rate=2001, options=("-DNX=1000", "-DRATES=2001")),
    "ring": Foreign(_numbered(40), (1.0,) * 40, (("rate", 1e3),), ("touch",), indicators=1, depends=(21,)),
    "plate": Foreign(_numbered(324), (0.0,) * 324, first_rate=1001),
    "crowd": Foreign(_numbered(6000), (1.0,) * 6000, first_rate=10001),
    "brusselator": Foreign(_numbered(50), (1.0,) * 25 + (3.0,) * 25, (("d", 0.02),)),
    "hub": Foreign(_numbered(41), (0.0,) * 41, (("rate", 1e3),)),
    "toggle": Foreign(("x",), (1.0,), (), ("sign",), indicators=1),
    "nudge": Foreign(("x",), (1.0,), (), ("nudges",), indicators=1),
    "graze": Foreign(("x",), (0.0,), (), ("entries",), indicators=1),
    "clock": Foreign(("x",), (0.0,), (("period", 0.1),), ("ticks", "late")),
    # next time events that are none, or one rounding of time ahead
    "no_time": Foreign(("x",), (0.0,), (("at", 0.5),)),
    "creeping": Foreign(("x",), (0.0,), (("at", 0.5),), ("ticks",)),
    "fatal": Foreign(("x",), (1.0,)),
    "ticker": Foreign((), (), (("period", 0.25),), ("ticks",)),
    "wrap": Foreign(("x",), (0.0,), (), ("steps", "wraps"), completes=True),
    "ending": Foreign(("x",), (1.0,), (), (), indicators=1),
    "restless": Foreign(("x",), (1.0,), (), (), indicators=1),
    "waver": Foreign(("x",), (1.0,), (("a", 1.5), ("b", 0.02), ("w", 50.0), ("falls", 1e9)), ("dips",), indicators=1),
    "pulse": PULSE,
    "pulse_stepped": replace(PULSE, experiment={"stopTime": "10", "stepSize": "0.002"}),
    "pulse_stopped": replace(PULSE, experiment={"startTime": "0", "stopTime": "0.5"}),
    "fickle": Foreign(("x",), (1.0,)),
    "grumble": Foreign(("x",), (1.0,)),
    "warning_grumble": Foreign(("x",), (1.0,)),
    "halting": Foreign(("x",), (0.0,), co_simulation=True),
    "brink": Foreign(("x",), (1.0,), indicators=1, echoes=("rate",)),
    "creeping_stepped": Foreign(("x",), (0.0,), (("at", 0.5),), ("ticks",), co_simulation=True),
    "integers": INTEGERS,
    "harm": Foreign(("x",), (0.0,), (("u", 0.0), ("harm", 0.0)), inputs=("u",), co_simulation=True, saves=True),
    "integers_fixed": replace(INTEGERS, any_step=False),
    "integers_refusing": INTEGERS,
    "forced": FORCED,
    "forced_silent": replace(FORCED, directional=False),
    "support": Foreign(
        ("x", "v"),
        (0.0, 0.0),
        (("c", 0.05), ("f0", 0.5), ("omega", 1.0), ("ks", 10.0), ("cs", 0.3), ("g", 4.0)),
        ("touches", "begun"),
        indicators=1,
        directional=True,
    ),
    "ball_steps": Foreign(("h", "v"), (1.0, 0.0), (("g", 9.81), ("e", 0.7)), ("bounces",), co_simulation=True),
    "driven": Foreign(("x",), (0.0,), (("u", 0.0), ("step", 0.0)), ("events",), inputs=("u", "step")),
}


def foreign(name: str, folder: Path, fmi: int = 2) -> Path:
    """The FMU ``name`` in ``folder``."""
    description = (_one, _two, _three)[fmi - 1](name, MODELS[name])
    order = name.partition("_")[0]
    options = (
        f"-DFMI={fmi}",
        f"-DPREFIX={name}_",
        "-Wno-unused-function",
        *ORDERS.get(order, ()),
        *MODELS[name].options,
    )
    source = FOLDER / f"{name.removeprefix(f'{order}_') if order in ORDERS else name}.c"
    if not source.exists():
        source = FOLDER / f"{name.rpartition('_')[0]}.c"
    return build(folder / f"{name}{fmi}.fmu", source, description, name, options=options)


def _one(name: str, m: Foreign) -> str:
    reals = [
        (s, i + 1, 'causality="output"', f' start="{v}"')
        for i, (s, v) in enumerate(zip(m.states, m.starts, strict=True))
    ]
    reals += [(f"der({s})", m.first_rate + i, "", "") for i, s in enumerate(m.states)]
    reals += [
        (p, 201 + i, 'causality="input"' if p in m.inputs else 'variability="parameter"', f'{_unit(p)} start="{v}"')
        for i, (p, v) in enumerate(m.parameters)
    ]
    reals += [(e, 151 + i, 'causality="output"', "") for i, e in enumerate(m.echoes)]
    lines = [f'<ScalarVariable name="{n}" valueReference="{i}" {kind}><Real{v}/>' for n, i, kind, v in reals]
    lines += [
        f'<ScalarVariable name="{w}" valueReference="{401 + i}" causality="output" variability="discrete"><Integer/>'
        for i, w in enumerate(m.numbers)
    ]
    any_step = f'canHandleVariableCommunicationStepSize="{_word(m.any_step)}"'
    stepped = f"<CoSimulation_StandAlone><Capabilities {any_step}/></CoSimulation_StandAlone>"
    units = '<UnitDefinitions><BaseUnit unit="rad/s"/></UnitDefinitions>' if _units(m) else ""
    variables = "\n".join(f"{line}</ScalarVariable>" for line in lines)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="1.0" modelName="{name}" modelIdentifier="{name}" guid="{name}"
numberOfContinuousStates="{len(m.states)}" numberOfEventIndicators="{m.indicators}">
{units}{_experiment(m)}<ModelVariables>
{variables}
</ModelVariables>{f"<Implementation>{stepped}</Implementation>" if m.co_simulation else ""}
</fmiModelDescription>
"""


def _two(name: str, m: Foreign) -> str:
    n = len(m.states)
    lines = [
        f'<ScalarVariable name="{s}" valueReference="{i + 1}" causality="output" initial="exact"><Real start="{v}"/>'
        for i, (s, v) in enumerate(zip(m.states, m.starts, strict=True))
    ]
    lines += [
        f'<ScalarVariable name="der({s})" valueReference="{m.first_rate + i}"><Real derivative="{i + 1}"/>'
        for i, s in enumerate(m.states)
    ]
    lines += [
        f'<ScalarVariable name="{p}" valueReference="{201 + i}" {_kind(m, p)}><Real{_unit(p)} start="{v}"/>'
        for i, (p, v) in enumerate(m.parameters)
    ]
    lines += [
        f'<ScalarVariable name="{w}" valueReference="{401 + i}" causality="output" variability="discrete"><Integer/>'
        for i, w in enumerate(m.numbers)
    ]
    lines += [
        f'<ScalarVariable name="{e}" valueReference="{151 + i}" causality="output"><Real/>'
        for i, e in enumerate(m.echoes)
    ]
    shown = len(m.numbers) + len(m.echoes)
    outputs = [*range(1, n + 1), *(2 * n + len(m.parameters) + i + 1 for i in range(shown))]
    unknown = "".join(f'<Unknown index="{n + 1 + i}"{_depends(m, i)}/>' for i in range(n))
    computed = "".join(f'<Unknown index="{i}"/>' for i in [*range(n + 1, 2 * n + 1), *outputs[n:]])
    variables = "\n".join(f"{line}</ScalarVariable>" for line in lines)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{name}" numberOfEventIndicators="{m.indicators}">
{_interface(name, m, f'completedIntegratorStepNotNeeded="{_word(not m.completes)}" providesDirectionalDerivative', "")}
{_units(m)}{_experiment(m)}<ModelVariables>
{variables}
</ModelVariables>
<ModelStructure><Outputs>{"".join(f'<Unknown index="{i}"/>' for i in outputs)}</Outputs>
<Derivatives>{unknown}</Derivatives><InitialUnknowns>{computed}</InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""


def _three(name: str, m: Foreign) -> str:
    states = range(len(m.states))
    lines = ['<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>']
    lines += [
        f'<Float64 name="{s}" valueReference="{i + 1}" causality="output" initial="exact" start="{m.starts[i]}"/>'
        for i, s in enumerate(m.states)
    ]
    lines += [
        f'<Float64 name="der({s})" valueReference="{m.first_rate + i}" derivative="{i + 1}"/>'
        for i, s in enumerate(m.states)
    ]
    lines += [
        f'<Float64 name="{p}" valueReference="{201 + i}" {_kind(m, p)}{_unit(p)} start="{v}"/>'
        for i, (p, v) in enumerate(m.parameters)
    ]
    lines += [f'<Float64 name="z{i}" valueReference="{301 + i}"/>' for i in range(m.indicators)]
    lines += [
        f'<Int32 name="{w}" valueReference="{401 + i}" causality="output" variability="discrete"/>'
        for i, w in enumerate(m.numbers)
    ]
    lines += [f'<Float64 name="{e}" valueReference="{151 + i}" causality="output"/>' for i, e in enumerate(m.echoes)]
    computed = [*(401 + i for i in range(len(m.numbers))), *(151 + i for i in range(len(m.echoes)))]
    structure = [f'<Output valueReference="{i}"/>' for i in [*(s + 1 for s in states), *computed]]
    structure += [f'<ContinuousStateDerivative valueReference="{m.first_rate + i}"{_depends(m, i)}/>' for i in states]
    structure += [f'<InitialUnknown valueReference="{m.first_rate + i}"/>' for i in states]
    structure += [f'<InitialUnknown valueReference="{i}"/>' for i in computed]
    structure += [
        f'<EventIndicator valueReference="{301 + i}" dependencies="{m.depends[i]}"/>' for i in range(m.indicators)
    ]
    exchange = f'needsCompletedIntegratorStep="{_word(m.completes)}" providesDirectionalDerivatives'
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="{name}" instantiationToken="{name}">
{_interface(name, m, exchange, 'hasEventMode="true"')}
{_units(m)}{_experiment(m)}<ModelVariables>
{chr(10).join(lines)}
</ModelVariables>
<ModelStructure>
{chr(10).join(structure)}
</ModelStructure>
</fmiModelDescription>
"""


def _interface(name: str, m: Foreign, exchange: str, events: str) -> str:
    if not m.co_simulation:
        return f'<ModelExchange modelIdentifier="{name}" {exchange}="{_word(m.directional)}"/>'
    any_step = f'canHandleVariableCommunicationStepSize="{_word(m.any_step)}"'
    states = 'canGetAndSetFMUstate="true"' if m.saves and not events else ""
    return f'<CoSimulation modelIdentifier="{name}" {any_step} {events} {states}/>'


def _experiment(m: Foreign) -> str:
    stated = " ".join(f'{name}="{value}"' for name, value in m.experiment.items())
    return f"<DefaultExperiment {stated}/>" if stated else ""


def _depends(m: Foreign, rate: int) -> str:
    return f' dependencies="{" ".join(map(str, m.rates_depend[rate]))}"' if m.rates_depend else ""


def _kind(m: Foreign, name: str) -> str:
    return 'causality="input"' if name in m.inputs else 'causality="parameter" variability="fixed"'


def _unit(name: str) -> str:
    return ' unit="rad/s"' if name == "omega" else ""


def _units(m: Foreign) -> str:
    return '<UnitDefinitions><Unit name="rad/s"/></UnitDefinitions>' if "omega" in dict(m.parameters) else ""


def _word(value: bool) -> str:
    return str(value).lower()
