"""Where the examples and documents lie: in the checkout, which the tests run beside even where the wheel is tested."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def checkout() -> Path:
    return Path(__file__).parents[2]
