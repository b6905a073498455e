"""What tests share: threads, their order, quiet logging, and a dataset that is recorded once a test run."""

import logging
import os
from collections.abc import Generator
from pathlib import Path

import pytest
from filelock import FileLock

# Before NumPy and PyTorch are loaded. Tests run side by side, as many as there are cores: threads beside them would
# only wait for one another, ten times as long as one thread computes.
os.environ.setdefault("OMP_NUM_THREADS", "1")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Start with the modules that have slow tests, so that no worker is left with one of them at the end."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


@pytest.fixture
def quiet_logging() -> Generator[None]:
    """Undo what the stock commands do to the root logger, which pytest listens on."""
    root = logging.getLogger()
    handlers, level = list(root.handlers), root.level
    yield
    root.handlers[:] = handlers
    root.setLevel(level)


@pytest.fixture
def one_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let commands start as few processes as they can: each imports for seconds."""
    monkeypatch.setattr("er_il.support.workers.cpu_count", lambda: 1)


@pytest.fixture
def small_films(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let films be of small pictures: each costs as long as ten steps of the world."""
    monkeypatch.setattr("er_il.evaluation.recording.PICTURE", (160, 120))


@pytest.fixture(scope="session")
def reach_cup(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of three demonstrations of Reach Cup in joint space and ERJ, recorded once a test run; only to be read."""
    from rich.progress import Progress

    from er_il.datasets.recipe import Recipe
    from er_il.datasets.recording import generate

    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent  # which all workers of the run share
    out = folder / "shared" / "reach_cup"
    out.parent.mkdir(exist_ok=True)
    with FileLock(folder / "shared.lock"):  # what is there already is left alone
        generate(Recipe.load("reach_cup").resized(3), ["joint", "erj"], out, Progress(disable=True), workers=1)
    return out
