"""Fitted values as an SSP 1.0 parameter set (.ssv), and the rig as a whole SSP (.ssp): FMU, structure and that set."""

from collections.abc import Sequence
from pathlib import Path

from fmu_models.base.digits import deviation
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import write_whole
from fmu_models.coupling import ssp_writer
from fmu_models.coupling.ssp_writer import FITTED, ParameterEntry
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.fmu.fmu import Fmu
from identification.transfer.values import HandedValue


def write_parameter_set(path: Path, values: Sequence[HandedValue], fmu: Fmu, *, overwrite: bool = False) -> Path:
    """Write the values as an .ssv file, with units defined by base units and what is known of each in its description.
    StickslipError: another suffix, or ``path`` exists and ``overwrite`` is false, or cannot be written."""
    if path.suffix != ".ssv":
        raise StickslipError(f"'{path}' must end in .ssv, as parameter sets do.")
    with write_whole(path, overwrite=overwrite) as temporary:
        temporary.write_bytes(ssp_writer.parameter_set(FITTED, _entries(values), fmu))
    return path


def write_ssp(
    path: Path, values: Sequence[HandedValue], fmu: Fmu, *, name: str = "rig", overwrite: bool = False
) -> Path:
    """Write a rig or machine as an SSP: its FMU as the models come, and the fitted values as a parameter set bound to
    it. StickslipError: another suffix, or ``path`` exists and ``overwrite`` is false, or cannot be written."""
    ssp_writer.check_path(path)
    system = CoupledSystem(name, {name: Unit(fmu)})
    return ssp_writer.write(path, system, {name: {FITTED: _entries(values)}}, overwrite=overwrite)


def _entries(values: Sequence[HandedValue]) -> list[ParameterEntry]:
    entries = []
    for value in values:
        fitted = f"; fitted, standard deviation {value.words}{deviation(value.deviation)} {value.unit}"
        meaning = value.description + ("" if value.deviation is None else fitted)
        entries.append(ParameterEntry(value.target, value.value, value.unit, meaning))
    return entries
