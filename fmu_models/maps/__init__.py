"""The maps of the suite: one file each, named like its map, with the declaration as ``MAP``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fmu_models.base.registry import Registry

if TYPE_CHECKING:
    from fmu_models.language.maps import Map

MAPS: Registry[Map] = Registry(
    kind="map", package=__name__, attribute="MAP", group="stickslip.maps", types=("fmu_models.language.maps.Map",)
)
names = MAPS.members
load = MAPS.load
