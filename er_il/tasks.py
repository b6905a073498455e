"""Names of the simulated tasks: ``reach_cup`` on the command line, ``sim_tasks/ReachCup-v0`` in Gymnasium."""

import re

import gymnasium

import sim_tasks  # noqa: F401  registers the tasks
from er_il.errors import UnknownNameError

NAMESPACE = "sim_tasks"


def task_names() -> tuple[str, ...]:
    """Names of the registered tasks, in alphabetical order."""
    return tuple(sorted(_ids()))


def task_id(name: str) -> str:
    """Gymnasium id of a task.

    Raises:
        UnknownNameError: no task has that name.
    """
    ids = _ids()
    if name not in ids:
        raise UnknownNameError("task", name, sorted(ids))
    return ids[name]


def _ids() -> dict[str, str]:
    """Task name -> id of its newest version."""
    specs = [spec for spec in gymnasium.registry.values() if spec.namespace == NAMESPACE]
    return {_snake_case(spec.name): spec.id for spec in sorted(specs, key=lambda spec: spec.version or 0)}


def _snake_case(name: str) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()
