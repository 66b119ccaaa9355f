"""Co-simulation of the same FMUs by this master, by libcosim's ECCO and by step doubling: calls of doStep and errors.

    python tests/benchmarks/bench_cosimulation.py

    loop       y = x + u/2, x' = u - x, twice in a ring, 2 s
    masses k   m x'' = F - k x - c x', and one behind a link of stiffness k that tells the force, 10 s

Calls are those of a unit, those of repeated steps included; errors |x - exact|/(1 + |exact|) at the end, over the
tolerance. ECCO runs in libcosim itself (pip install libcosimpy), with the tolerance as both of its own. Step doubling
is written here in the way of OMSimulator's `mav2`: a step of held inputs beside two of half of it, repeated where they
differ by more. A peer is stopped at MOST calls.
"""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract
from fmpy.fmi2 import FMU2Slave
from numpy.typing import NDArray
from scipy.linalg import expm

from fmu_models.codegen.package import export
from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.coupling.wiring import Connection
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.automaton import Automaton
from fmu_models.language.declaration import Output
from fmu_models.language.quantities import Input, Parameter, State

TOLERANCES = (1e-3, 1e-6, 1e-8)
MOST = 20_000  # calls of a peer
SAFETY, SHRINK, GROW = 0.8, 0.2, 2.5
C, K1, K2, DAMPING = 0.05, 1.0, 2.0, 0.02  # of the masses; DAMPING: of the link, times sqrt(k)

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """Two units a and b; wires as (unit, output, unit, input), the first two a power bond; exact: of the states."""

    fmus: Mapping[str, Fmu]
    parameters: Mapping[str, Mapping[str, float]]
    start: Mapping[str, Mapping[str, float]]
    wires: Sequence[tuple[str, str, str, str]]
    states: Sequence[tuple[str, str]]
    end: float
    matrix: Vector

    @property
    def numbers(self) -> dict[str, dict[str, int]]:
        """Value references by unit and name."""
        return {u: {n: int(v.valueReference) for n, v in fmu.variables.items()} for u, fmu in self.fmus.items()}

    def exact(self, time: float) -> Vector:
        """The states at a time."""
        start = [self.start[unit].get(name, 0.0) for unit, name in self.states]
        return np.asarray(expm(self.matrix * time) @ start, dtype=float)

    def error(self, time: float, states: Vector) -> float:
        exact = self.exact(time)
        return float(np.max(np.abs(states - exact) / (1.0 + np.abs(exact))))


def declared() -> list[Automaton]:
    x, v, u = State("x", "m", "place"), State("v", "m/s", "speed"), Input("u", 0.0, "m", "input")
    one, m = Parameter("a", 1.0, "1/s", "rate"), Parameter("m", 1.0, "kg", "mass")
    k, c = Parameter("k", K1, "N/m", "spring"), Parameter("c", C, "N.s/m", "damping")
    link, loss = Parameter("kc", 1.0, "N/m", "link"), Parameter("dc", 0.0, "N.s/m", "damping of the link")
    force, place, speed = (
        Input("F", 0.0, "N", "force"),
        Input("z", 0.0, "m", "place of the other"),
        Input("w", 0.0, "m/s", "speed of the other"),
    )
    pull = link * (x - place) + loss * (v - speed)
    told = [Output("place", x, "m", "place"), Output("speed", v, "m/s", "speed")]
    pulls = [Output("pull", pull, "N", "force on the other")]
    return [
        _model("ring", [x], {x: one * (u - x)}, [Output("y", x + u / 2, "m", "output")]),
        _model("mass", [x, v], {x: v, v: (force - k * x - c * v) / m}, told),
        _model("linked", [x, v], {x: v, v: (-pull - k * x - c * v) / m}, pulls),
    ]


def _model(name: str, states: Sequence[State], flows: Mapping[Any, Any], outputs: Sequence[Output]) -> Automaton:
    return Automaton(name=name, title=name, source="benchmark", states=states, flows=flows, outputs=outputs)


def cases(folder: Path) -> dict[str, Case]:
    """The cases by their names, with FMUs exported to a folder."""
    fmus = {}
    for model in declared():
        export(model, folder / f"{model.name}.fmu", fmi_version="2.0", overwrite=True)
        fmus[model.name] = Fmu.open(folder / f"{model.name}.fmu")
    # u_a = x_b + u_b/2 and u_b = x_a + u_a/2
    inputs = np.linalg.solve([[1.0, -0.5], [-0.5, 1.0]], [[0.0, 1.0], [1.0, 0.0]])
    ring = [("a", "y", "b", "u"), ("b", "y", "a", "u")]
    pair = {"a": fmus["ring"], "b": fmus["ring"]}
    start = {"a": {"x": 1.0}, "b": {"x": 0.5}}
    found = {"loop": Case(pair, {}, start, ring, [("a", "x"), ("b", "x")], 2.0, inputs - np.eye(2))}
    for k in (1.0, 100.0):
        d = DAMPING * np.sqrt(k)
        rows = [[0, 1, 0, 0], [-K1 - k, -C - d, k, d], [0, 0, 0, 1], [k, d, -K2 - k, -C - d]]
        wires = [("a", "speed", "b", "w"), ("b", "pull", "a", "F"), ("a", "place", "b", "z")]
        states = [(unit, name) for unit in "ab" for name in "xv"]
        units, begun = {"a": fmus["mass"], "b": fmus["linked"]}, {"a": {"x": 1.0}, "b": {}}
        values = {"b": {"k": K2, "kc": k, "dc": d}}
        found[f"masses {k:g}"] = Case(units, values, begun, wires, states, 10.0, np.array(rows, dtype=float))
    return found


def ours(case: Case, tolerance: float, **settings: Any) -> tuple[int, float]:
    """Calls of a unit, and the error at the end."""
    units = {u: Unit(fmu, case.parameters.get(u, {}), case.start[u]) for u, fmu in case.fmus.items()}
    joined = [Connection(f"{a}.{y}", f"{b}.{u}") for a, y, b, u in case.wires]
    system = CoupledSystem("bench", units, joined, solver="co-simulation", stop_time=case.end, tolerance=tolerance)
    run = couple(system.changed(**settings))
    calls = int(run.method.partition("at most ")[2].split()[0])
    return calls, case.error(case.end, np.array([run[f"{u}.{name}"][-1] for u, name in case.states]))


def _begun(case: Case) -> dict[str, FMU2Slave]:
    slaves = {}
    for unit, fmu in case.fmus.items():
        description = fmu.description
        assert description.coSimulation is not None
        slave = FMU2Slave(
            unzipDirectory=extract(str(fmu.path)), guid=description.guid, instanceName=unit,
            modelIdentifier=description.coSimulation.modelIdentifier,
        )  # fmt: skip
        slave.instantiate()
        slave.setupExperiment(tolerance=1e-12, startTime=0.0)
        slave.enterInitializationMode()
        for name, value in {**case.parameters.get(unit, {}), **case.start[unit]}.items():
            slave.setReal([fmu.variables[name].valueReference], [value])
        slave.exitInitializationMode()
        slaves[unit] = slave
    return slaves


def doubling(case: Case, tolerance: float) -> tuple[int, float]:
    """The same by steps of held inputs beside two halves."""
    slaves, number = _begun(case), case.numbers

    def exchange() -> Vector:
        values, before = list[float](), None
        while values != before:  # feed-through settles
            before = values
            values = [slaves[a].getReal([number[a][y]])[0] for a, y, _, _ in case.wires]
            for (_, _, b, u), value in zip(case.wires, values, strict=True):
                slaves[b].setReal([number[b][u]], [value])
        return np.array(values)

    def step(time: float, h: float) -> Vector:
        for slave in slaves.values():
            slave.doStep(currentCommunicationPoint=time, communicationStepSize=h)
        return exchange()

    exchange()
    time, h, calls = 0.0, 1e-3 * case.end, 0
    while time < case.end * (1 - 1e-12) and calls < MOST:
        h = min(h, case.end - time)
        saved = {unit: slave.getFMUstate() for unit, slave in slaves.items()}
        whole = step(time, h)
        for unit, slave in slaves.items():
            slave.setFMUstate(saved[unit])
        exchange()
        step(time, 0.5 * h)
        halves = step(time + 0.5 * h, 0.5 * h)
        calls += 3
        error = float(np.max(np.abs(whole - halves) / (1.0 + np.abs(halves)))) / tolerance
        accepted = error <= 1.0
        for unit, slave in slaves.items():
            if not accepted:
                slave.setFMUstate(saved[unit])
            slave.freeFMUstate(saved[unit])
        if accepted:
            time += h
        else:
            exchange()
        h *= min(max(SAFETY * max(error, 1e-12) ** -0.5, SHRINK), GROW)
    states = np.array([slaves[u].getReal([number[u][name]])[0] for u, name in case.states])
    for slave in slaves.values():
        slave.terminate()
        slave.freeInstance()
    return calls, case.error(time, states)


def ecco(case: Case, tolerance: float) -> tuple[int, float]:
    """The same by libcosim's ECCO, whose last step may go beyond the end."""
    algorithms, slaves, executions, observers, logs = (
        importlib.import_module(f"libcosimpy.Cosim{name}")
        for name in ("Algorithm", "Slave", "Execution", "Observer", "Logging")
    )
    logs.log_output_level(logs.CosimLogLevel.FATAL)
    parameters = algorithms.EccoParams(
        step_size=1e-3 * case.end, min_step_size=1e-6, max_step_size=0.1 * case.end, min_change_rate=0.2,
        max_change_rate=1.5, abs_tolerance=tolerance, rel_tolerance=tolerance,
    )  # fmt: skip
    algorithm = algorithms.CosimAlgorithm.create_ecco_algorithm(parameters)
    execution = executions.CosimExecution.from_algorithm(algorithm)
    observer = observers.CosimObserver.create_last_value()
    execution.add_observer(observer)
    index, number = {}, case.numbers
    for unit, fmu in case.fmus.items():
        index[unit] = execution.add_local_slave(slaves.CosimLocalSlave(str(fmu.path), unit))
        for name, value in {**case.parameters.get(unit, {}), **case.start[unit]}.items():
            execution.real_initial_value(index[unit], number[unit][name], value)
    for a, y, b, u in case.wires:
        execution.connect_real_variables(index[a], number[a][y], index[b], number[b][u])
    (a, y, b, u), (_, back, _, taken) = case.wires[:2]
    algorithm.add_power_bond(index[a], number[a][y], number[a][taken], index[b], number[b][back], number[b][u])
    calls = 0
    while execution.status().current_time < case.end * 1e9 and calls < MOST:
        execution.step()
        calls += 1
    values = [observer.last_real_values(index[u], [number[u][name]])[0] for u, name in case.states]
    return calls, case.error(execution.status().current_time * 1e-9, np.array(values))


MASTERS: dict[str, Callable[[Case, float], tuple[int, float]]] = {
    "this master": ours,
    "without rollback": lambda case, tolerance: ours(case, tolerance, rollback=False),
    "step doubling": doubling,
    "ECCO of libcosim": ecco,
}


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        for name, case in cases(Path(folder)).items():
            for master, run in MASTERS.items():
                cells = []
                for tolerance in TOLERANCES:
                    try:
                        calls, error = run(case, tolerance)
                        cells.append(f"{calls:7d} ({error / tolerance:.2g})" + (" stopped" if calls >= MOST else ""))
                    except ImportError as missing:
                        cells.append(f"{missing.name} is not installed")
                print(f"{name:10} {master:18} {'  '.join(f'{cell:>20}' for cell in cells)}", flush=True)


if __name__ == "__main__":
    main()
