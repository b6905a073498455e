"""The registered tasks. Classes and leaders are named by dotted strings, so that registering imports none of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import gymnasium


@dataclass(frozen=True)
class TaskEntry:
    """Registration of a task with Gymnasium."""

    task: str  # the class's ``task``: its name in snake case
    entry_point: str  # "module:Class" of a subclass of sim_tasks.tasks.arm_task.ArmTask
    max_steps: int  # control steps after which an episode is truncated
    leader: str | None = None  # "module:Class" of a subclass of sim_tasks.leader.leader.Leader; None: it has none

    @property
    def id(self) -> str:
        """Gymnasium id: the package is the namespace, the class the name."""
        module, name = self.entry_point.split(":")
        return f"{module.split('.')[0]}/{name}-v0"


_entries: dict[str, TaskEntry] = {}


def register(entry: TaskEntry) -> None:
    """Register a task with Gymnasium; one of the same name is replaced."""
    _entries[entry.task] = entry
    # Environments say themselves, as a ValueError, that they were not reset.
    gymnasium.register(entry.id, entry_point=entry.entry_point, max_episode_steps=entry.max_steps, order_enforce=False)


def registered() -> Mapping[str, TaskEntry]:
    """Registered tasks by name."""
    return MappingProxyType(_entries)
