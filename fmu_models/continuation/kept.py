"""Branches on the disk: what has been found as texts, from each of which one can go on.

A motion is told by its unknowns, its tangent and the phase that it begins at; what its run shows is seen again, to the
last bit.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from fmu_models.continuation.problem.node import Node
from fmu_models.continuation.problem.problem import Passing, Problem, Seen, Vector
from fmu_models.continuation.special.border_collision import Collision
from fmu_models.continuation.special.discontinuous import Touch
from fmu_models.continuation.step.way import Found
from fmu_models.families.store import Chain, Store

KINDS: Mapping[str, Any] = {kind.__name__: kind for kind in (Found, Touch, Passing, Collision)}


class Keeper:
    """Keeps the branches of one family, or none of them where there is no store. problem: one of the family."""

    def __init__(self, store: Store | None, problem: Problem) -> None:
        self.store, self.family = store, problem
        self._problems: list[tuple[Problem, Any]] = []
        self._seen: dict[tuple[int, bytes], Seen] = {}

    def pieces(self) -> Pieces:
        """Where the next branch is kept, or is already."""
        return Pieces() if self.store is None else Pieces(self, self.store.chain())

    def told(self, value: object) -> object:
        """As JSON."""
        if isinstance(value, Node):
            place = {"of": self._place(value), "z": self.told(value.z), "tangent": self.told(value.tangent)}
            return {"is": "Node", **place, "iterations": value.iterations}
        if is_dataclass(value):
            content = {field.name: self.told(getattr(value, field.name)) for field in fields(value)}
            return {"is": type(value).__name__, **content}
        if isinstance(value, np.ndarray):
            return {"is": "array", "values": value.tolist()}
        return [self.told(item) for item in value] if isinstance(value, list | tuple) else value

    def made(self, content: object) -> Any:
        """What was told so."""
        if isinstance(content, list):
            return tuple(self.made(item) for item in content)
        if not isinstance(content, dict) or "is" not in content:
            return content
        kind, inner = content["is"], {name: self.made(item) for name, item in content.items() if name != "is"}
        if kind == "array":
            return np.array(inner["values"], dtype=float)
        return self._node(**inner) if kind == "Node" else KINDS[kind](**inner)

    def _place(self, node: Node) -> int | dict[str, Any]:
        """Number of the problem of a node and of its scales, and at first what they are."""
        same = [i for i, (problem, _) in enumerate(self._problems) if problem is node.problem]
        for i in same:
            if np.array_equal(self._problems[i][1], node.scales):
                return i
        self._problems.append((node.problem, node.scales))
        return {"problem": same[0] if same else node.problem.told(), "scales": node.scales.tolist()}

    def _node(self, of: int | dict[str, Any], z: Vector, tangent: Vector, iterations: int) -> Node:
        if isinstance(of, dict):
            family = of["problem"]
            problem = self._problems[family][0] if isinstance(family, int) else self.family.like(family)
            self._problems.append((problem, np.array(of["scales"])))
            of = len(self._problems) - 1
        problem, scales = self._problems[of]
        key = of, z.tobytes()
        if key not in self._seen:
            self._seen[key] = problem.see(z)
        return Node(problem, scales, z, self._seen[key], tangent, iterations)


class Pieces:
    """A branch piece by piece. known: those that are there."""

    def __init__(self, keeper: Keeper | None = None, chain: Chain | None = None) -> None:
        self._keeper, self._chain = keeper, chain
        self.known: list[Any] = [keeper.made(json.loads(text)) for text in chain.texts] if keeper and chain else []

    @property
    def where(self) -> str:
        """How to go on, as the end of a sentence."""
        return f" in '{self._chain.path}'. Go on: --resume (in Python resume=True)" if self._chain else ""

    def put(self, piece: object) -> None:
        """Keep the next one."""
        if self._keeper and self._chain:
            self._chain.put(json.dumps(self._keeper.told(piece)))
        self.known.append(piece)
