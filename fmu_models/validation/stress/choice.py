"""Which cases of stress are run: by name of the model, by pattern, a quick choice, or drawn at random."""

import fnmatch

from fmu_models import oscillators
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.validation.stress.cases import Case
from fmu_models.validation.stress.workers import cases_of, drawn


def listed_cases(models: list[str], pattern: str | None, until: float | None, quick: bool) -> list[Case]:
    """The cases asked for; of a quick look without models those of one model per kind of contact.

    Raises:
        StickslipError: an unknown model, or no case left.
    """
    if not models:
        models = _one_per_kind() if quick else oscillators.names()
    cases = [case for name in dict.fromkeys(models) for case in cases_of(name, until)]
    if pattern is None:
        return [case for case in cases if case.quick or not quick]
    chosen = [case for case in cases if fnmatch.fnmatchcase(case.name, pattern) and (case.quick or not quick)]
    if not chosen:
        names = [case.name for case in cases if case.quick or not quick]
        raise StickslipError(f"No case matches '{pattern}'.{nearest(pattern, names)}")
    return chosen


def random_cases(models: list[str], count: int, seed: int, until: float | None) -> list[Case]:
    """So many cases, as equal numbers of each model as there can be.

    Raises:
        StickslipError: an unknown model.
    """
    names = list(dict.fromkeys(models)) or oscillators.names()
    share, remainder = divmod(count, len(names))
    return [case for i, name in enumerate(names) for case in drawn(name, share + (i < remainder), seed, until)]


def _one_per_kind() -> list[str]:
    """The first model by name of every kind of contact."""
    first_cases: dict[str, str] = {}
    for name in oscillators.names():
        for contact in oscillators.load(name).contacts:
            first_cases.setdefault(type(contact).__name__, name)
    return sorted(set(first_cases.values()))
