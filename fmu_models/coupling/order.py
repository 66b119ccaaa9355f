"""The order in which values pass between units: stages of outputs and the inputs they feed.

An output that depends on an input of its unit without a state between (direct feed-through, as the unit's description
tells) belongs to a later stage than that input. Where such dependencies form a ring, its outputs and inputs are
one stage: an algebraic loop.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fmu_models.coupling.wiring import Wire

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu

Port = tuple[str, str]


@dataclass(frozen=True)
class CouplingStage:
    """Outputs, and the wires that begin at them, both sorted by unit."""

    loop: bool
    outputs: tuple[Port, ...]
    wires: tuple[Wire, ...]


def discrete(fmu: Fmu, name: str) -> bool:
    """Whether a variable changes at events only."""
    variable = fmu.variables[name]
    return variable.variability == "discrete" or not str(variable.type).startswith(("Real", "Float"))


def feedthrough(fmu: Fmu, output: str) -> set[str]:
    """Inputs on which an output depends directly; all where the description does not tell."""
    inputs = {name for name, v in fmu.variables.items() if v.causality == "input"}
    if discrete(fmu, output):
        # it changes at events, where values are exchanged until nothing changes any more
        return set()
    for unknown in fmu.description.outputs:
        if unknown.variable is not None and unknown.variable.name == output:
            if unknown.dependencies is None:
                return inputs
            return inputs & {str(v.name) for v in unknown.dependencies if v is not None}
    return inputs


def _reached(before: Mapping[Port, set[Port]]) -> dict[Port, set[Port]]:
    """All that a port depends on, over others too."""
    reach = {port: set(sources) for port, sources in before.items()}
    grown = True
    while grown:
        grown = False
        for port, known in reach.items():
            more = known.union(*(reach[other] for other in known))
            grown |= len(more) > len(known)
            reach[port] = more
    return reach


def stages(fmus: Mapping[str, Fmu], wires: Sequence[Wire]) -> list[CouplingStage]:
    """The stages of a coupled system, in the order in which they are exchanged."""
    rank = {unit: i for i, unit in enumerate(fmus)}
    from_output: dict[Port, list[Wire]] = {}
    for wire in wires:
        from_output.setdefault(wire.source, []).append(wire)
    feeds = {wire.target: wire.source for wire in wires if not discrete(fmus[wire.target[0]], wire.target[1])}
    before = {
        port: {feeds[(port[0], name)] for name in feedthrough(fmus[port[0]], port[1]) if (port[0], name) in feeds}
        for port in from_output
    }
    level: dict[Port, int] = {}
    rings: list[tuple[int, bool, list[Port]]] = []
    reach = _reached(before)
    for port in sorted(before, key=lambda port: (len(reach[port]), port not in reach[port])):  # after what it reaches
        if port in level:
            continue
        ring = [port, *(other for other in before if other != port and port in reach[other] and other in reach[port])]
        earlier = [level[p] + 1 for port in ring for p in before[port] if p not in ring]
        depth = max(earlier, default=0)
        loop = len(ring) > 1 or ring[0] in before[ring[0]]
        level |= dict.fromkeys(ring, depth)
        rings.append((depth, loop, ring))
    # simple outputs of one level make one stage, every loop has its own
    groups: list[tuple[bool, list[Port]]] = []
    for depth in sorted({d for d, _, _ in rings}):
        simple = [port for d, loop, ring in rings if d == depth and not loop for port in ring]
        groups += [(False, simple)] if simple else []
        groups += [(True, ring) for d, loop, ring in rings if d == depth and loop]

    def place(fmu: str, name: str) -> tuple[int, bool]:
        return rank[fmu], discrete(fmus[fmu], name)

    order = []
    for loop, ports in groups:
        ordered = sorted(ports, key=lambda port: place(*port))
        begun = [wire for port in ordered for wire in from_output[port]]
        order.append(CouplingStage(loop, tuple(ordered), tuple(sorted(begun, key=lambda wire: place(*wire.target)))))
    return order
