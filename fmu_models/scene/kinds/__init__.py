"""What a scene may compute: one file each, with the kind as ``KIND``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fmu_models.base.registry import Registry

if TYPE_CHECKING:
    from fmu_models.scene.kinds.kind import Kind

KINDS: Registry[Kind] = Registry(
    kind="kind of computation",
    package=__name__,
    attribute="KIND",
    group="stickslip.scene_kinds",
    types=("fmu_models.scene.kinds.kind.Kind",),
)
