"""Names of the simulated tasks: ``reach_cup`` on the command line, ``sim_tasks/ReachCup-v0`` in Gymnasium.

Tasks come from packages that name a module under the entry points ``er_il.tasks``; importing the module
registers them with Gymnasium, in a namespace of the entry point's name.
"""

import inspect
import re
from functools import cache
from importlib.metadata import entry_points
from typing import Any

import gymnasium
from gymnasium.envs.registration import load_env_creator

from er_il.support.errors import UnknownNameError

GROUP = "er_il.tasks"
WITHIN = "cup_range"  # option of the tasks that place a cup: the sides [m] of the rectangle in which it starts


def task_names() -> tuple[str, ...]:
    """Names of the registered tasks, in alphabetical order."""
    return tuple(sorted(_ids()))


def task_id(name: str) -> str:
    """Gymnasium id of a task, given its name or, of any registered environment, the id itself.

    Raises:
        UnknownNameError: no task has that name.
    """
    ids = _ids()
    if name in gymnasium.registry:
        return name
    if name not in ids:
        raise UnknownNameError("task", name, sorted(ids))
    return ids[name]


def takes_option(name: str, option: str) -> bool:
    """True if the environment of a task takes a keyword argument of its own."""
    creator: Any = gymnasium.registry[task_id(name)].entry_point
    if isinstance(creator, str):
        creator = load_env_creator(creator)
    # Classes pass on what their bases take.
    return any(
        option in inspect.signature(each).parameters for each in getattr(creator, "__mro__", (creator, object))[:-1]
    )


@cache
def _namespaces() -> frozenset[str]:
    """Namespaces of the packages that provide tasks; their tasks are registered."""
    providers = entry_points(group=GROUP)
    for provider in providers:
        provider.load()
    return frozenset(provider.name for provider in providers)


def _ids() -> dict[str, str]:
    """Task name -> id of its newest version."""
    namespaces = _namespaces()
    specs = [spec for spec in gymnasium.registry.values() if spec.namespace in namespaces]
    return {_snake_case(spec.name): spec.id for spec in sorted(specs, key=lambda spec: spec.version or 0)}


def _snake_case(name: str) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()
