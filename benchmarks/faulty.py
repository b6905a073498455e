"""Processes that run a command of er-il, quickly started and watched."""

import multiprocessing
import os
import sys
from collections.abc import Sequence
from multiprocessing.context import ForkServerContext
from multiprocessing.process import BaseProcess
from pathlib import Path

LOG = "log.txt"


def preloaded() -> ForkServerContext:
    """Processes of this kind begin with LeRobot's imports, which take longer than most commands."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["lerobot.policies", "lerobot.datasets", "er_il.policy.actor", "er_il.cli"])
    return context


def start(arguments: Sequence[str], folder: Path, workers: int = 1) -> BaseProcess:
    """Start a command in a folder, with as many worker processes; what it says is added to the folder's log."""
    process = preloaded().Process(target=_run, args=(tuple(arguments), str(folder), workers))
    process.start()
    return process


def _run(arguments: Sequence[str], folder: str, workers: int) -> None:
    os.environ["LOKY_MAX_CPU_COUNT"] = str(workers)
    os.chdir(folder)
    with Path(LOG).open("a") as log:
        for stream in (1, 2):
            os.dup2(log.fileno(), stream)
    sys.argv = ["er-il", *arguments]
    from er_il.cli import main

    main()
