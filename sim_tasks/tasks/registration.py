"""The registration of a task's class, and the leader that it names."""

import importlib
from collections.abc import Callable, Iterator
from typing import Any, Protocol

import numpy as np

from er_il.support.errors import ErIlError, UnknownNameError
from sim_tasks.registry import TaskEntry, registered


class NoLeaderError(ErIlError):
    """A demonstration was asked of a task that is registered without a leader."""


class Demonstrator(Protocol):
    """Demonstrates episodes of one world."""

    def demonstrate(self, seed: int) -> Iterator[np.ndarray]:
        """Yield actions (n+1,): joint angles [rad] and gripper opening, one each control period."""
        ...


def registration(task: str) -> TaskEntry:
    """The entry of a task.

    Raises:
        UnknownNameError: no task of that name is registered.
    """
    entries = registered()
    if task not in entries:
        raise UnknownNameError("task", task, sorted(entries))
    return entries[task]


def leader_class(task: str) -> Callable[..., Demonstrator]:
    """The class of a task's leader, imported now; it is called with the world and the leader's settings.

    Raises:
        NoLeaderError: the task has none.
    """
    path = registration(task).leader
    if path is None:
        valid = sorted(name for name, entry in registered().items() if entry.leader)
        raise NoLeaderError(
            f"The task {task} has no leader to demonstrate it. Tasks with a leader: {', '.join(valid)}."
        )
    module, name = path.split(":")
    leader: Any = getattr(importlib.import_module(module), name)
    return leader
