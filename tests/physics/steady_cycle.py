"""The last cycle of a long run, measured to rounding: period from events, extremes where the velocity vanishes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_models.codegen.package import built
from fmu_models.simulation.fmu import Fmu
from fmu_models.simulation.system import simulate
from fmu_models.simulation.trajectory import Event


@dataclass(frozen=True)
class Cycle:
    """One period that begins where ``contact`` starts to stick."""

    start: float
    period: float
    minimum: float
    maximum: float
    stick: dict[str, float]
    angles: dict[tuple[str, int], list[float]]

    @property
    def sticking(self) -> set[str]:
        return {contact for contact, share in self.stick.items() if share > 0}


def disc_rig(contacts: tuple[str, ...]) -> Fmu:
    return Fmu.open(built("disc_rig", contacts=contacts))


def steady_cycle(fmu: Fmu, *, until: float = 60.0, **run) -> Cycle:
    """Run to ``until`` and take the last full cycle from stick to stick."""
    events = simulate(fmu, until, **run).events
    landings = [event for event in events if event.after == 0]
    first = landings[-1].contact
    marks = [event.time for event in landings if event.contact == first]
    start, stop = marks[-2], marks[-1]
    inside = [event for event in events if start <= event.time < stop]
    times = np.unique(np.concatenate([np.linspace(start, stop, 2001), [event.time for event in inside]]))
    trajectory = simulate(fmu, until, output_times=times, **run)
    extremes = _extremes(times, trajectory["theta"], trajectory["omega"], trajectory["der(omega)"])
    at = dict(zip(times, trajectory["theta"], strict=True))
    angles: dict[tuple[str, int], list[float]] = {}
    for event in inside:
        angles.setdefault((event.contact, event.after), []).append(float(at[event.time]))
    return Cycle(start, stop - start, min(extremes), max(extremes), _stick_shares(inside, start, stop), angles)


def _extremes(t: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> list[float]:
    """Values of q where v changes sign, from the quintic through q, v, a at both ends of the interval."""
    found = []
    for i in np.flatnonzero(np.sign(v[:-1]) * np.sign(v[1:]) < 0):
        h = t[i + 1] - t[i]
        rows = [[1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 0, 2, 0, 0, 0], [1] * 6, range(6), [0, 0, 2, 6, 12, 20]]
        ends = [q[i], h * v[i], h * h * a[i], q[i + 1], h * v[i + 1], h * h * a[i + 1]]
        quintic = np.polynomial.Polynomial(np.linalg.solve(np.array([list(row) for row in rows], float), ends))
        roots = quintic.deriv().roots()
        inside = [r.real for r in roots if abs(r.imag) < 1e-9 and -1e-9 <= r.real <= 1 + 1e-9]
        found += [float(quintic(r)) for r in inside]
    return found


def _stick_shares(events: list[Event], start: float, stop: float) -> dict[str, float]:
    shares = {event.contact: 0.0 for event in events}
    for event in events:
        if event.after == 0:
            later = [e.time for e in events if e.contact == event.contact and e.time > event.time]
            shares[event.contact] += (min(later, default=stop) - event.time) / (stop - start)
    return shares
