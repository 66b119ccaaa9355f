"""Contact laws: one file each, with the class as ``LAW``. ``coulomb`` is the smallest to copy for a new one."""

from __future__ import annotations

from typing import Any

from fmu_models.base.registry import Registry

LAWS: Registry[Any] = Registry(kind="law", package=__name__, attribute="LAW", group="stickslip.laws")
