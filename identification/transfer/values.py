"""What a fit hands on: its parameters and the rig's constants, by the names and in the units of the rig's FMU."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from fmu_models.base.errors import StickslipError, nearest, refuse_unknown
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.mechanism import Mechanism
from identification.calibration.result import Calibration
from identification.fit.parts import AT_LEAST
from identification.fit.result import FrictionFit
from identification.fitted_model.machine import identifier
from identification.fitted_model.model import FittedModel, fitted_model
from identification.machines.machine_fit import MachineFit


@dataclass(frozen=True)
class HandedValue:
    """One value. name: in the rig's FMU; target: where it goes, if it has another name there; deviation: standard
    deviation, all parts together (None: a constant); at_least: whether it lacks a part of unknown size; all in
    ``unit``."""

    name: str
    target: str
    value: float
    unit: str
    deviation: float | None
    description: str
    at_least: bool = False

    @property
    def words(self) -> str:
        """The words before the deviation."""
        return AT_LEAST if self.at_least else ""

    def in_unit(self, unit: str | None, where: str) -> float:
        """The value in the unit of where it goes. StickslipError: that has no unit, or one of something else; ``where``
        begins the message."""
        from fmu_models.coupling.wiring import conversion

        if unit == self.unit:
            return self.value
        if unit is None:
            if self.unit == "1":
                return self.value
            raise StickslipError(
                f"{where}: '{self.target}' has no unit there, and {self.unit} cannot be taken for granted. State its "
                "unit in the model, or leave the value out with --only."
            )
        try:
            factor, offset = conversion(self.unit, unit)
        except ValueError:
            raise StickslipError(
                f"{where}: '{self.target}' is in {unit} there, the fit in {self.unit}, which cannot be converted. Name "
                "the right parameter with --name, or leave it out with --only."
            ) from None
        return factor * self.value + offset


def handed_values(
    fit: FrictionFit, *, only: Sequence[str] = (), renamed: Mapping[str, str] | None = None
) -> tuple[HandedValue, ...]:
    """What a fit hands on. only: names of the rig's FMU, all if empty; renamed: names there by these names.
    StickslipError: a name that the fit does not hand on, or two values for one name."""
    model = fitted_model(fit)
    return _chosen({name: _value(fit, model, name) for name in model.parameters}, only, renamed)


def machine_values(
    machine: Mechanism, fit: MachineFit, *, only: Sequence[str] = (), renamed: Mapping[str, str] | None = None
) -> tuple[HandedValue, ...]:
    """What a machine hands on, made of its fit by `machine_with`: base parameters and what was known; the rest is as
    for `handed_values`, errors too.
    """
    deviations = {identifier(parameter.name): parameter.standard_deviation for parameter in fit.parameters}
    values = {
        p.name: HandedValue(p.name, p.name, p.value, p.unit, deviations.get(p.name), p.description)
        for p in machine.parameters
    }
    return _chosen(values, only, renamed)


def calibration_values(
    fmu: Fmu, calibration: Calibration, *, only: Sequence[str] = (), renamed: Mapping[str, str] | None = None
) -> tuple[HandedValue, ...]:
    """What a calibration hands on to its model: parameters that all logs share, and those that were held; the rest is
    as for `handed_values`, errors too.
    """
    values = {name: (value, None) for name, value in calibration.held.items()}
    values |= {parameter.name: (parameter.value, parameter.standard_deviation) for parameter in calibration.parameters}
    handed = {}
    for name in (name for name in values if name in fmu.parameters):
        (value, deviation), variable = values[name], fmu.variables[name]
        unit, meaning = str(variable.unit or "1"), str(variable.description or name)
        handed[name] = HandedValue(name, name, value, unit, deviation, meaning)
    return _chosen(handed, only, renamed)


def _chosen(
    values: Mapping[str, HandedValue], only: Sequence[str], renamed: Mapping[str, str] | None
) -> tuple[HandedValue, ...]:
    for name in (*only, *(renamed or {})):
        refuse_unknown(name, values, f"The fit hands on no '{name}'.")
    chosen = [values[name] for name in values if not only or name in only]
    chosen = [replace(value, target=(renamed or {}).get(value.name, value.name)) for value in chosen]
    targets = [value.target for value in chosen]
    for target in targets:
        if targets.count(target) > 1:
            raise StickslipError(f"Two values would go to '{target}'. Rename them apart.")
    return tuple(chosen)


def _value(fit: FrictionFit, model: FittedModel, name: str) -> HandedValue:
    variable = model.fmu.variables[name]
    fitted = {q.name: q for q in fit.parameters}
    # a single disc's parameters have no number in the fit; what an FMU's law computes from several has no deviation
    parameter = fitted.get(name) or (fitted.get(name[:-1]) if name[-1:] in "01" else None)
    same = parameter is not None and parameter.value == model.parameters[name]
    return HandedValue(
        name=name,
        target=name,
        value=model.parameters[name],
        unit=variable.unit or "1",
        deviation=parameter.total_deviation if parameter is not None and same else None,
        description=str(variable.description or name),
        at_least=parameter is not None and same and fit.at_least(parameter.name),
    )


def check_targets(values: Sequence[HandedValue], fmu: Fmu) -> dict[str, float]:
    """The values by the names and in the units of the parameters of an FMU. StickslipError: a name or unit that does
    not match."""
    from fmu_models.coupling.wiring import unit_of
    from fmu_models.fmu.start_values import check_parameter

    targets = {}
    for item in values:
        if item.target not in fmu.variables:
            raise StickslipError(
                f"'{fmu.path}' has no parameter '{item.target}'.{nearest(item.target, fmu.parameters)} Name it with "
                f"--name {item.name}=ITS_NAME, or choose what to hand on with --only."
            )
        value = item.in_unit(unit_of(fmu, fmu.variables[item.target]), f"'{fmu.path}'")
        check_parameter(fmu, item.target, value)
        targets[item.target] = value
    return targets
