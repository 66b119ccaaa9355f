"""Every model of ``models/``, built once a session for all versions of FMI."""

from __future__ import annotations

import pytest
from models import Models, foreign

from fmu_models.fmu.fmu import Fmu


@pytest.fixture(
    scope="session", params=[pytest.param(1, marks=pytest.mark.nightly), 2, 3], ids=["fmi1", "fmi2", "fmi3"]
)
def fmi(request: pytest.FixtureRequest) -> int:
    return request.param


@pytest.fixture(scope="session")
def model(fmi: int, tmp_path_factory: pytest.TempPathFactory) -> Models:
    """The opened FMU of a model by its name."""
    folder = tmp_path_factory.mktemp("foreign")
    made: dict[str, Fmu] = {}

    def get(name: str) -> Fmu:
        if name not in made:
            made[name] = Fmu.open(foreign(name, folder, fmi))
        return made[name]

    return get
