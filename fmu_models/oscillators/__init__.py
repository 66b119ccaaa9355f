"""The oscillators of the suite: one file each, named like its model, with the declaration as ``MODEL``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fmu_models.base.registry import Registry

if TYPE_CHECKING:
    from fmu_models.language.mechanism import Mechanism

MODELS: Registry[Mechanism] = Registry(
    kind="model",
    package=__name__,
    attribute="MODEL",
    group="stickslip.oscillators",
    types=("fmu_models.language.mechanism.Mechanism", "fmu_models.language.automaton.Automaton"),
)
names = MODELS.members
load = MODELS.load
