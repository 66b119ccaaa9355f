"""Motions whose inputs are polynomials, and their derivatives, against the exact flow of each mode in complex numbers.

    m x'' = F(t) - k x - c x' + friction,  |friction| <= f, of a belt that runs at u(t)

Such inputs come from importers that extrapolate. The modes are linear: their steps are sums. Beside a pendulum, which
changes nothing, the same motion goes by the series of the model.
"""

from __future__ import annotations

import ctypes
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from close_columns import close
from quick_export import quick_export
from scipy.linalg import expm

from fmu_models import Coordinate, Coulomb, Friction, Input, Mechanism, Parameter
from fmu_models.fmu.fmu import Fmu
from fmu_models.toolchain.compiler import compile_shared

pytestmark = pytest.mark.digits

SHIM = """
#include "all.c"
#include <stdlib.h>

/* a run with derivatives, whose inputs have derivatives from the second on from its start on; 0: it is done */
WHOLE_RUN_EXPORT int curved(SensitivityRun *s, const double *bend, char *message)
{
    Instance *m = stickslip_open(message);
    Run *r = &m->core.run;
    const int64_t rows = s->run.n_times;
    s->room = malloc((size_t)stickslip_sensitivity_room(s->n_directions));
    s->run.n_times = 1;
    int status = stickslip_sensitivity(m, s);
    memcpy(r->at.bend, bend, sizeof r->at.bend);
    r->at.curved = 1;
    run_touched(r);
    tangents_choose(r, s->room);
    s->run.n_times = rows;
    if (!status) status = stickslip_sensitivity(m, s);
    free(s->room);
    stickslip_close(m);
    return status;
}

WHOLE_RUN_EXPORT int run_curved(int n, const uint32_t *set, const double *values, int rows, const double *times,
                                int columns, const uint32_t *states, double *points, int n_by, const uint32_t *by,
                                double *derivatives, const double *bend, int room, double *events,
                                double *event_derivatives, char *message)
{
    ContactEvent *kept = calloc((size_t)room, sizeof *kept);
    SensitivityRun s = {0};
    s.run = (WholeRun){.n_times = rows, .times = times, .n_values = columns, .references = states, .values = points,
                       .event_capacity = room, .events = kept, .allowance = 100000};
    s.start = (RunStart){n, set, values, 0.0, 1e-14};
    s.n_directions = n_by;
    s.directions = by;
    s.derivatives = derivatives;
    s.event_derivatives = event_derivatives;
    const int status = curved(&s, bend, message);
    for (int i = 0; i < s.run.n_events; i++)
        events[i] = kept[i].time;
    free(kept);
    return status ? -1 : (int)s.run.n_events;
}
"""
POWERS = 4  # inputs are cubics
MODES = [1, 0, -1, 0, 1]  # slips, sticks and slips
TABLE = {"m": 1.25, "k": 4.0, "c": 0.3, "f": 2.5, "x": 0.1, "v": 1.4, "F": 0.2, "u": 0.5}
# derivatives of the inputs at the start, from the first on
FORCE, BELT = (0.4, -3.0, 6.0), (-0.3, 0.5, -0.4)
UNITS = "kg", "N/m", "N s/m", "N"
TINY, ROOM = 1e-40, 5000


def block(*, beside: bool) -> Mechanism:
    m, k, c, f = (Parameter(name, TABLE[name], unit, name) for name, unit in zip("mkcf", UNITS, strict=True))
    F, u = Input("F", TABLE["F"], "N", "force"), Input("u", TABLE["u"], "m/s", "speed of the belt")
    x = Coordinate("x", "m", "place", velocity="v", start=TABLE["x"], v_start=TABLE["v"])
    angle = Coordinate("angle", "rad", "angle of a pendulum", velocity="turn", start=0.3)
    J, h = (Parameter(name, float(beside), unit, name) for name, unit in (("J", "kg m2"), ("h", "J")))
    return Mechanism(
        name="beside" if beside else "block", title="block on a belt", source="",
        coordinates=[x, angle] if beside else [x],
        kinetic_energy=m * x.v**2 / 2 + int(beside) * J * angle.v**2 / 2,
        potential_energy=k * x**2 / 2 - int(beside) * h * sympy.cos(angle),
        applied={x: F - c * x.v}, contacts=[Friction(name="belt", slip=x.v - u, law=Coulomb(f, sympy.S.One))],
    )  # fmt: skip


class Curved:
    """Runs of a block by the engine."""

    def __init__(self, folder: Path, *, beside: bool) -> None:
        fmu = quick_export(block(beside=beside), folder / f"{beside}.fmu", fmi_version="2.0")
        with zipfile.ZipFile(fmu) as packed:
            files = {n.removeprefix("sources/"): packed.read(n) for n in packed.namelist() if n.startswith("sources/")}
        library = compile_shared({**files, "curved.c": SHIM}, folder / f"{beside}.so", files=("curved.c",))
        self.run = ctypes.CDLL(str(library)).run_curved
        self.variables = Fmu.open(fmu).variables

    def __call__(self, times: np.ndarray, by: list[str]) -> tuple[np.ndarray, ...]:
        values = {**TABLE, "F_rate": FORCE[0], "u_rate": BELT[0]}
        reference = lambda names: np.array([self.variables[n].valueReference for n in names], np.uint32)  # noqa: E731
        rows = np.concatenate([[0.0], times])
        points, derivatives = np.empty((len(rows), 2)), np.empty((len(rows), 2, len(by)))
        events, later, message = np.empty(ROOM), np.empty((ROOM, len(by))), ctypes.create_string_buffer(512)
        bend = np.zeros((2, 5))
        bend[:, : POWERS - 2] = FORCE[1:], BELT[1:]
        pointer = lambda array: ctypes.c_void_p(array.ctypes.data)  # noqa: E731
        given = reference(values), np.array(list(values.values())), reference(["x", "v"]), reference(by)
        found = self.run(
            len(values), pointer(given[0]), pointer(given[1]), len(rows), pointer(rows), 2, pointer(given[2]),
            pointer(points), len(by), pointer(given[3]), pointer(derivatives), pointer(bend), ROOM, pointer(events),
            pointer(later), message,
        )  # fmt: skip
        assert found >= 0, message.value.decode()
        return points[1:], derivatives[1:], events[:found], later[:found]


@pytest.fixture(scope="module")
def blocks(tmp_path_factory: pytest.TempPathFactory) -> dict[bool, Curved]:
    folder = tmp_path_factory.mktemp("curved")
    return {beside: Curved(folder, beside=beside) for beside in (False, True)}


class Exact:
    """z = (x, v, 1, t, t^2/2, t^3/6) in each mode: 1 and -1 slipping, 0 sticking; and what falls to zero there."""

    def __init__(self, p: dict[str, Any]) -> None:
        push = np.array([-p["k"], -p["c"], p["F"], *FORCE], complex)
        belt = np.array([0.0, 0.0, p["u"], *BELT], complex)
        rises = np.array([0.0, 0.0, *BELT, 0.0], complex)
        f = p["f"] * np.eye(6)[2]
        slip, load = np.eye(6)[1] - belt, p["m"] * rises - push
        self.falls = {1: [slip], 0: [f - load, f + load], -1: [-slip]}
        self.rates = {}
        for side in (1, 0, -1):
            self.rates[side] = rates = np.zeros((6, 6), complex)
            rates[3:, 2:5] = np.eye(3)
            rates[0, 1] = 1.0
            rates[1] = (push - side * f) / p["m"] if side else rises
        self.start = np.array([p["x"], p["v"], 1.0, 0.0, 0.0, 0.0], complex)

    def at(self, modes: list[int], near: list[float], times: np.ndarray) -> tuple[list[Any], list[Any]]:
        """Points at times and times of events, which are near those given."""
        z, now, ends, points = self.start, 0.0 + 0.0j, [], []
        for i, mode in enumerate(modes):
            rates = self.rates[mode]
            until = near[i] if i < len(near) else np.inf
            began = near[i - 1] if i else 0.0
            points += [expm(rates * (t - now)) @ z for t in times if began <= t < until]
            if until == np.inf:
                break
            row = min(self.falls[mode], key=lambda row: abs(row @ expm(rates * (until - now)) @ z))
            t: Any = until - now
            for _ in range(12):
                then = expm(rates * t) @ z
                t = t - (row @ then) / (row @ rates @ then)
            z, now = expm(rates * t) @ z, now + t
            ends.append(now)
        return [p[:2] for p in points], ends


TIMES = np.linspace(0.05, 6.0, 60)


@pytest.mark.parametrize("beside", [False, True])
def test_motions_and_all_their_derivatives_are_those_of_the_exact_flow(blocks: dict[bool, Curved], beside: bool):
    by = list(TABLE)
    points, derivatives, events, later = blocks[beside](TIMES, by)
    exact = [Exact({**TABLE, name: TABLE[name] + TINY * 1j}).at(MODES, events.tolist(), TIMES) for name in by]
    assert close(points, np.real(exact[0][0]), 1e-12)
    assert close(events, np.real(exact[0][1]), 1e-12)
    assert close(np.moveaxis(derivatives, 2, 0), np.imag([points for points, _ in exact]) / TINY, 1e-10)
    assert close(later.T, np.imag([events for _, events in exact]) / TINY, 1e-10)


def test_sums_and_series_agree(blocks: dict[bool, Curved]):
    sums, series = (blocks[beside](TIMES, list(TABLE)) for beside in (False, True))
    assert all(close(a, b, 1e-11) for a, b in zip(sums, series, strict=True))
