"""What the cost of a model grows like with its size, row by row, with the sizes that it refuses.

    python tests/benchmarks/bench_growth.py [row ...]

Times are CPU seconds, of a build those of the compiler too, of a run the fastest of some; an exponent is that of the
cost from one size to the next.
"""

from __future__ import annotations

import itertools
import math
import os
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sympy

sys.path.append(str(Path(__file__).parents[1] / "physics"))
from pendulums import pendulum

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.c_source import sources
from fmu_models.codegen.package import built, export
from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.coupling.wiring import Connection
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.contacts import Contact
from fmu_models.language.declaration import Output
from fmu_models.language.friction import Friction
from fmu_models.language.impacts import Impact, Newton
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Input, Parameter
from fmu_models.lowering.lower import lower
from fmu_models.simulation.run import simulate
from fmu_models.simulation.trajectory import Events, Trajectory

REPETITIONS = 3
Row = tuple[float, ...]


def cost(work: Callable[[], Any]) -> tuple[float, Any]:
    """CPU seconds of one call, and what it returns."""
    begin = time.process_time()
    result = work()
    return time.process_time() - begin, result


def fastest(work: Callable[[], Any]) -> tuple[float, Any]:
    """The same of the fastest of some calls."""
    return min((cost(work) for _ in range(REPETITIONS)), key=lambda found: found[0])


def table(title: str, columns: Sequence[str], sizes: Sequence[int], measured: Callable[[int], Row]) -> None:
    """One line per size: what was measured, and the exponents from the size before."""
    print(f"\n{title}\n{'n':>6}" + "".join(f"{name:>22}" for name in columns))
    before: tuple[int, Row] | None = None
    for n in sizes:
        found = measured(n)
        texts = []
        for i, value in enumerate(found):
            grown = ""
            if before is not None and value > 0 and before[1][i] > 0:
                grown = f"(^{math.log(value / before[1][i]) / math.log(n / before[0]):.2f})"
            texts.append(f"{value:12.4g} {grown:>9}")
        print(f"{n:6d}" + "".join(texts), flush=True)
        before = n, found


def refused(title: str, build: Callable[[], Any]) -> None:
    """A size beyond the limit, and what is said."""
    try:
        build()
    except StickslipError as error:
        print(f"{title}: {error}")
    else:
        raise SystemExit(f"{title}: was not refused")


def symbolic(build: Callable[[], Mechanism]) -> tuple[float, float, float]:
    """Seconds to declare, to lower and to write C."""
    declared, mechanism = cost(build)
    lowered, system = cost(lambda: lower(mechanism))
    written, _ = cost(lambda: sources(system))
    return declared, lowered, written


def fmu_of(mechanism: Mechanism) -> tuple[float, Fmu]:
    """Seconds to build it, and the FMU."""
    begin = built_so_far()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        fmu = Fmu.open(export(mechanism, Path(folder) / "model.fmu"))
    return built_so_far() - begin, fmu


def built_so_far() -> float:
    """CPU seconds of this process and its compilers."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def masses(n: int, contacts: Callable[[list[Coordinate]], list[Contact]] = lambda _: []) -> Mechanism:
    """Unit masses between springs of 100 N/m."""
    q = [Coordinate(f"q{i}", "m", f"place of mass {i}", velocity=f"v{i}") for i in range(n)]
    m = Parameter("m", 1.0, "kg", "mass", positive=True)
    k = Parameter("k", 100.0, "N/m", "stiffness", positive=True)
    stretch = [q[0], *(b - a for a, b in itertools.pairwise(q))]
    return Mechanism(
        name=f"chain_of_{n}",
        title="chain",
        source="benchmark",
        coordinates=q,
        kinetic_energy=sympy.Add(*(m * x.v**2 / 2 for x in q)),
        potential_energy=sympy.Add(*(k * s**2 / 2 for s in stretch)),
        contacts=contacts(q),
    )


def on_ground(q: list[Coordinate]) -> list[Contact]:
    """Friction of every mass on the ground."""
    N = Parameter("N", 1.0, "N", "normal force of each mass")
    return [Friction(name=f"f{i}", slip=x.v, law=Coulomb(N, sympy.Float(4 + i % 7 / 2))) for i, x in enumerate(q)]


def displaced(n: int) -> dict[str, float]:
    """Start values that move every mass."""
    return {f"q{i}": 0.3 * math.sin(1.7 * i + 0.2) for i in range(n)}


def run_of(fmu: Fmu, until: float, start: dict[str, float]) -> tuple[float, Trajectory]:
    """CPU seconds of a run to its end, one row."""
    return fastest(lambda: simulate(fmu, until, start=start, output_times=np.array([until])))


def friction(n: int) -> Row:
    """Masses with friction: symbolic work, build, and a run of 2 s per event."""
    declared, lowered, written = symbolic(lambda: masses(n, on_ground))
    build, fmu = fmu_of(masses(n, on_ground))
    seconds, run = run_of(fmu, 2.0, displaced(n))
    return declared, lowered, written, build, 1e6 * seconds / len(run.events), 1e6 * seconds / run.steps / n


def smooth(n: int) -> Row:
    """Masses without friction: symbolic work, and a step of the run."""
    declared, lowered, written = symbolic(lambda: masses(n))
    _, fmu = fmu_of(masses(n))
    seconds, run = run_of(fmu, 20.0, displaced(n))
    return declared, lowered, written, 1e6 * seconds / run.steps


def chain_of_links(n: int) -> Mechanism:
    """Point masses on massless links, from nearly one line."""
    return pendulum([Coordinate(f"q{i}", "rad", "angle", velocity=f"w{i}", start=0.9 - 0.03 * i) for i in range(n)])


def links(n: int) -> Row:
    """Links of a pendulum: symbolic work, build, a step of the run and what it loses of its energy."""
    declared, lowered, written = symbolic(lambda: chain_of_links(n))
    build, fmu = fmu_of(chain_of_links(n))
    seconds, run = run_of(fmu, 1.0, {})
    energy = simulate(fmu, 1.0, output_times=np.linspace(0.0, 1.0, 11))["energy"]
    return declared + lowered + written, build, 1e6 * seconds / run.steps, np.ptp(energy) / np.abs(energy).max()


def redundant(n: int) -> Row:
    """Frictions side by side under one block that a slowly rising force does not move: a step in stick."""
    q = Coordinate("q", "m", "place", velocity="v")
    m = Parameter("m", 1.0, "kg", "mass", positive=True)
    N = Parameter("N", 1.0, "N", "normal force of each")
    F = Input("F", 0.0, "N", "force")
    block = Mechanism(
        name=f"block_on_{n}",
        title="block",
        source="benchmark",
        coordinates=[q],
        kinetic_energy=m * q.v**2 / 2,
        applied={q: F * sympy.sin(q / Parameter("d", 1.0, "m", "period"))},
        contacts=[Friction(name=f"f{i}", slip=q.v, law=Coulomb(N, sympy.Float(1 + i % 3))) for i in range(n)],
    )
    _, fmu = fmu_of(block)
    times = np.linspace(0.0, 1.0, 201)
    seconds, run = fastest(lambda: simulate(fmu, 1.0, start={"q": 1.0}, inputs={"F": 0.5}, output_times=times))
    assert not run.events
    return (1e6 * seconds / times.size,)


def dropped(n: int) -> Mechanism:
    """Masses between springs above the ground, which they hit all at once and sliding."""
    x = [Coordinate(f"x{i}", "m", "place", velocity=f"u{i}", v_start=0.5 + 0.1 * (i % 5)) for i in range(n)]
    y = [Coordinate(f"y{i}", "m", "height", velocity=f"v{i}", start=0.1) for i in range(n)]
    m = Parameter("m", 1.0, "kg", "mass", positive=True)
    k = Parameter("k", 100.0, "N/m", "stiffness", positive=True)
    g = Parameter("g", 9.81, "m/s2", "gravity")
    e = Parameter("e", 0.3, "1", "restitution", minimum=0)
    mu = Parameter("mu", 0.4, "1", "friction", minimum=0)
    neighbours = zip(range(n), range(1, n), strict=False)
    return Mechanism(
        name=f"row_of_{n}",
        title="row",
        source="benchmark",
        coordinates=[*x, *y],
        kinetic_energy=sympy.Add(*(m * q.v**2 / 2 for q in (*x, *y))),
        potential_energy=sympy.Add(
            *(m * g * q for q in y), *(k * ((x[b] - x[a]) ** 2 + (y[b] - y[a]) ** 2) / 2 for a, b in neighbours)
        ),
        contacts=[
            Impact(name=f"c{i}", gap=b, restitution=Newton(e), slip=a.v, mu=mu)
            for i, (a, b) in enumerate(zip(x, y, strict=True))
        ],
    )


def rigid(n: int) -> Row:
    """Rigid contacts with friction: a run of 1 s per event, with its impacts."""
    build, fmu = fmu_of(dropped(n))
    seconds, run = run_of(fmu, 1.0, {})
    return build, 1e6 * seconds / len(run.events)


def rows(n: int) -> Row:
    """Bytes per row at the peak of a run of the disc rig, per bytes of its array, and bytes per event."""
    fmu = Fmu.open(built("disc_rig"))
    times = np.linspace(0.0, 25.0, n)
    simulate(fmu, 1.0)
    tracemalloc.start()
    run = simulate(fmu, 25.0, inputs={"w0": 0.83}, output_times=times)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    array = 8 * len(run.values) * n
    assert isinstance(run.events, Events)
    return peak / n, peak / array, float(run.events.rows.itemsize)


def coupled(n: int) -> Row:
    """Masses in a ring, each a unit: co-simulated, steps of .01 s and controlled, and both per the joint solver."""
    x = Coordinate("x", "m", "place", velocity="v")
    m = Parameter("m", 1.0, "kg", "mass", positive=True)
    k, kc = Parameter("k", 4.0, "N/m", "spring"), Parameter("kc", 2.5, "N/m", "link")
    other = Input("other", 0.0, "m", "place of the one before")
    mass = Mechanism(
        name="mass",
        title="mass",
        source="benchmark",
        coordinates=[x],
        kinetic_energy=m * x.v**2 / 2,
        potential_energy=k * x**2 / 2,
        applied={x: kc * (other - x)},
        outputs=[Output("place", x, "m", "place")],
    )
    _, fmu = fmu_of(mass)
    names = [f"m{i}" for i in range(n)]
    units = {name: Unit(fmu, start={"x": 1.0} if name == "m0" else {}) for name in names}
    wires = [Connection(f"{names[i - 1]}.place", f"{names[i]}.other") for i in range(n)]

    def seconds(solver: str, **options: Any) -> float:
        system = CoupledSystem("ring", units, wires, stop_time=1.0, solver=solver, **options)
        return fastest(lambda: couple(system))[0]

    fixed, controlled, joint = seconds("co-simulation", step=0.01), seconds("co-simulation"), seconds("auto")
    return fixed, controlled, fixed / joint, controlled / joint


def main(chosen: Sequence[str]) -> None:
    work = ("declare, s", "lower, s", "C, s")
    everything: dict[str, Callable[[], None]] = {
        "friction": lambda: table(
            "masses with friction", (*work, "build, s", "us/event", "us/(step n)"), (8, 13, 14, 50, 100), friction
        ),
        "smooth": lambda: table("masses without friction", (*work, "us/step"), (32, 64, 128), smooth),
        "links": lambda: table(
            "links of a pendulum", ("symbolic, s", "build, s", "us/step", "energy lost"), (3, 5, 10, 30), links
        ),
        "redundant": lambda: table("frictions that hold one block", ("us/row",), (8, 16, 32, 64), redundant),
        "rigid": lambda: table("rigid contacts with friction", ("build, s", "us/event"), (4, 8, 16, 32), rigid),
        "rows": lambda: table("rows of a run", ("bytes/row", "of its array", "bytes/event"), (20_000, 200_000), rows),
        "coupled": lambda: table(
            "coupled units", ("fixed, s", "controlled, s", "fixed/joint", "contr./joint"), (8, 16, 32, 64), coupled
        ),
    }
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as cache:
        os.environ["STICKSLIP_CACHE"] = cache
        fmu_of(masses(2, on_ground))  # imports and the compiler's own library are no growth
        for name in chosen or everything:
            everything[name]()
    if not chosen or "rigid" in chosen:
        refused("33 rigid contacts", lambda: dropped(33))
    if not chosen or "friction" in chosen:
        refused("201 contacts", lambda: masses(201, on_ground))


if __name__ == "__main__":
    main(sys.argv[1:])
