"""The order in which Placo adds up the tasks of a program.

Placo keeps tasks in the order of their addresses in memory, which differs from process to process, and so do the last
bits of what it solves. They are enough for two simulations of the same actions to part after some minutes.
"""

import os
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import BinaryIO

import placo

ATTEMPTS = 1000  # each of at most 24 orders is about as likely: a few milliseconds, as a rule
STDOUT = 1  # file descriptor


def in_order[Tasks](
    make: Callable[[], tuple[placo.KinematicsSolver, Tasks]], names: tuple[str, ...]
) -> tuple[placo.KinematicsSolver, Tasks]:
    """Make a program and its tasks again and again, until Placo adds these up in the order of their ``names``.

    Raises:
        RuntimeError: they never were.
    """
    others = []  # alive, or the next one would lie at the same addresses
    for _ in range(ATTEMPTS):
        made = make()
        if _order(made[0]) == names:
            return made
        others.append(made)
    raise RuntimeError(f"Placo never has its tasks in the order {', '.join(names)}.")


def _order(program: placo.KinematicsSolver) -> tuple[str, ...]:
    """Names of a program's tasks, as Placo goes through them; it tells them on the standard output alone."""
    with tempfile.TemporaryFile() as file:
        with _stdout_to(file):
            program.dump_status()
        file.seek(0)
        return tuple(re.findall(r"^ +\* (\S+) \[", file.read().decode(), re.MULTILINE))


@contextmanager
def _stdout_to(file: BinaryIO) -> Iterator[None]:
    """Let what C++ writes to the standard output go to a file."""
    try:
        before = os.dup(STDOUT)
    except OSError:  # there is none
        before = -1
    os.dup2(file.fileno(), STDOUT)
    try:
        yield
    finally:
        if before < 0:
            os.close(STDOUT)
        else:
            os.dup2(before, STDOUT)
            os.close(before)
