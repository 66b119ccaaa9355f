"""Every oscillator, exported for every version of FMI; a new one is found by itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from fmu_models import oscillators
from fmu_models.codegen.package import FMI_VERSIONS, built
from fmu_models.fmu.fmu import Fmu

CASES = [(model, version) for model in oscillators.names() for version in FMI_VERSIONS]


@pytest.fixture(scope="session", params=CASES, ids=[f"{model}-fmi{version[0]}" for model, version in CASES])
def case(request: pytest.FixtureRequest) -> tuple[str, str]:
    """Name of an oscillator and version of FMI."""
    return request.param


@pytest.fixture(scope="session")
def path(case: tuple[str, str]) -> Path:
    """The exported FMU."""
    return built(case[0], fmi_version=case[1])


@pytest.fixture(scope="session")
def fmu(path: Path) -> Fmu:
    """The same, opened."""
    return Fmu.open(path)


@pytest.fixture
def input_name(fmu: Fmu) -> str:
    """Its first input."""
    if not fmu.inputs:
        pytest.skip("the model has no input")
    return fmu.inputs[0]
