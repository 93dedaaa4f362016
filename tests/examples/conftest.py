"""Paths of the examples and documents in the checkout, also when the wheel is tested."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def checkout() -> Path:
    return Path(__file__).parents[2]
