"""What a point of a branch costs, in CPU time, and in parts of the runs with tangents that it is made of.

    python tests/benchmarks/bench_branches.py [repetitions]

Per system: points and specials, ms per point with all that is located, what of that the engine takes, runs per point,
and how many times the cheapest possible point costs, one run with its tangents, made again on its own in turn with it.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from contextlib import contextmanager
from typing import Any

from fmu_models import Strobe, branch, load
from fmu_models.simulation.whole_run import Differentiator

PHASE = 0.51016360854330479
FLIGHT, SPEED = 2.0 * math.pi - PHASE, math.pi
LAW = {"N0": 5.0, "mu_s0": 0.65, "mu_k0": 0.35, "p0": 15.0}


def systems() -> dict[str, tuple[Strobe, str, tuple[float, float], dict[str, Any]]]:
    """By name: the strobe, parameter and range, and how to begin."""
    ball = {"x": 1.2 * math.sin(PHASE) + SPEED * FLIGHT - FLIGHT**2 / 2, "v": SPEED - FLIGHT}
    support, disc = load("discontinuous_support"), load("disc_rig", contacts=["disc0"])
    hinge = {"x": -5.19128647e-6, "v": 0.03296490834399}
    return {
        "support": (Strobe(support, forcing="omega", parameters={"omega": 0.8}), "omega", (0.8, 1.4), {}),
        "ball": (
            Strobe(load("bouncing_ball"), forcing="omega", parameters={"g": 1.0, "omega": 1.0, "e": 0.5, "A": 1.2}),
            "A",
            (0.9, 2.6),
            {"start": ball},
        ),
        "stick-slip": (Strobe(load("forced_stick_slip"), forcing="omega", every=2), "omega", (1.4, 2.0), {}),
        "disc": (
            Strobe(disc, period=0.91, autonomous=True, parameters={**LAW, "w0": 2.0}),
            "w0",
            (1.5, 2.6),
            {"settle": True},
        ),
        "hinge": (Strobe(load("hinge_clearance"), forcing="f"), "f", (0.35, 0.45), {"start": hinge}),
    }


def cpu(run: Callable[[], Any]) -> float:
    """s."""
    begin = time.process_time()
    run()
    return time.process_time() - begin


@contextmanager
def counted():
    """Runs of the engine with tangents, and their seconds."""
    made, run = [], Differentiator.run

    def timed(*given: Any) -> Any:
        begin = time.process_time()
        found = run(*given)
        made.append(time.process_time() - begin)
        return found

    Differentiator.run = timed  # type: ignore[method-assign]
    try:
        yield made
    finally:
        Differentiator.run = run  # type: ignore[method-assign]


def main(repetitions: int) -> None:
    for name, (system, over, between, how) in systems().items():
        found: Any = None

        def follow(system: Strobe = system, over: str = over, between: Any = between, how: Any = how) -> None:
            nonlocal found
            found = branch(system, over, between, **how)

        follow()
        with counted() as made:
            taken = cpu(follow)
        engine, runs = sum(made) / taken, len(made)

        def see(nodes: Any = found.nodes) -> None:
            for node in nodes:
                node.problem.see(node.z)

        pairs = [(cpu(follow), cpu(see)) for _ in range(repetitions)]
        points = len(found.values)
        least = min(one for one, _ in pairs) / points
        ratio = sorted(one / other for one, other in pairs)[repetitions // 2]
        print(
            f"{name:10} {points:4} points, {len(found.special):2} special   {1e3 * least:6.2f} ms a point   engine "
            f"{100.0 * engine:3.0f} %   {runs / points:5.1f} runs a point   {ratio:5.1f} times one run",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3)
