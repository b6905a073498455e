import logging
from collections.abc import Generator

import pytest


@pytest.fixture
def quiet_logging() -> Generator[None]:
    """Undo what the stock commands do to the root logger, which pytest listens on."""
    root = logging.getLogger()
    handlers, level = list(root.handlers), root.level
    yield
    root.handlers[:] = handlers
    root.setLevel(level)
