"""Toy results that the tests of the report share; nobody changes them."""

from pathlib import Path

import pytest

from reproduction.report.gallery import Picture
from reproduction.report.results import Results
from tests.core_cases import kr16
from tests.reproduction.report import toy


@pytest.fixture(scope="session")
def toy_root() -> Path:
    return toy.shared_root()


@pytest.fixture
def toy_results(toy_root: Path) -> Results:
    return toy.results(toy_root, kr16())


@pytest.fixture(scope="session")
def pictures() -> dict[str, Picture]:
    return {picture.entry.name: picture for picture in toy.shared_pictures()}
