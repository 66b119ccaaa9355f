"""What a scene may compute: every analysis, and one file each with a kind of its own as ``KIND``."""

from pathlib import Path

from fmu_models.analyses.declaration import ANALYSES
from fmu_models.base.registry import Reference, Registry
from fmu_models.scene.kinds.analysis import kind_of
from fmu_models.scene.kinds.kind import Kind


class _Kinds(Registry[Kind]):
    """Kinds that are derived from an analysis stand beside those that have a file of their own."""

    def members(self) -> list[str]:
        return sorted({*super().members(), *ANALYSES.members()})

    def names(self) -> list[str]:
        return sorted({*super().names(), *ANALYSES.names()})

    def load(self, reference: Reference, beside: Path | None = None) -> Kind:
        if reference in ANALYSES.names():
            return kind_of(ANALYSES.load(reference))
        return super().load(reference, beside)


KINDS = _Kinds(
    kind="kind of computation",
    package=__name__,
    attribute="KIND",
    group="stickslip.scene_kinds",
    types=("fmu_models.scene.kinds.kind.Kind",),
)
