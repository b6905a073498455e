"""Sources of the viewer: the trace of a rollout, or an episode of a dataset, each with the scene around the arm."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium

from er_il.arms.robot import robot_with
from er_il.datasets.record import RECORD, DatasetRecord
from er_il.datasets.wiring import Wiring
from er_il.envs.protocol import robot_env
from er_il.envs.tasks import task_id, task_names
from er_il.evaluation.trace import SUFFIX, Trace
from er_il.support.errors import DatasetError
from er_il.support.shapes import Shape
from er_il.viewer.episode import trace_of_episode


def read_source(
    source: Path, episode: int | None = None, arm: str = "", wirings: Sequence[Wiring] = ()
) -> tuple[Trace, list[Shape]]:
    """Read what is to be viewed, and the world around the arm; there is none unless a simulated task made the data.

    Args:
        source: A trace (``.npz``), or the folder of a dataset.
        episode: Which episode of a dataset; the first if omitted.
        arm: Which arm of a dataset of several.
        wirings: The arms of a dataset that does not know them.

    Raises:
        DatasetError: there is no such trace, dataset, or episode.
        UnknownNameError: the dataset has no such arm.
    """
    if source.is_dir():
        trace = trace_of_episode(source, episode or 0, arm, wirings)
        if not (source / RECORD).is_file():
            return trace, []
        recipe = DatasetRecord.read(source).recipe
        trace = replace(trace, task=recipe.task)
        return trace, shapes_of(trace, recipe.replaced(cameras=()).environment)
    if not source.exists():
        raise DatasetError(f"There is no dataset or trace {source}.")
    if source.suffix != SUFFIX:
        raise DatasetError(f"{source} is neither the folder of a dataset nor a trace ({SUFFIX}) of a rollout.")
    if episode is not None or arm:
        raise DatasetError(f"{source} holds one episode of one arm: leave out --episode and --arm.")
    trace = Trace.load(source)
    return trace, shapes_of(trace)


def shapes_of(trace: Trace, environment: Mapping[str, Any] | None = None) -> list[Shape]:
    """The world of a trace: that of its task on its seed; empty if no simulated task has that name.

    Args:
        trace: The episode.
        environment: Keyword arguments of the task's environment; the robot of the trace's arm if omitted.
    """
    if trace.task not in task_names():
        return []
    env = gymnasium.make(task_id(trace.task), **(environment or {"arm": robot_with(trace.spec["arm"]["name"])}))
    try:
        env.reset(seed=trace.seed)
        return list(robot_env(env).scene_geometry())
    finally:
        env.close()
