"""FMUs that the tests of a file share: built and opened by the first that needs one; listing tests builds none."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu


class LazyFmu(Fmu):
    """The FMU of ``built`` with these arguments."""

    def __init__(self, model: str, **options: Any) -> None:
        vars(self)["_arguments"] = model, options

    def __getattr__(self, name: str) -> Any:
        if name not in {field.name for field in fields(Fmu)}:
            raise AttributeError(name)
        model, options = vars(self)["_arguments"]
        opened = Fmu.open(built(model, **options))
        vars(self).update(vars(opened), _opened=opened)  # whose folder goes with it
        return vars(self)[name]
