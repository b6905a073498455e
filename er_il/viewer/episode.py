"""An episode of a dataset as a trace: each action decoded from the measured joints, images and all."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from er_il.arms.portable import arm_spec
from er_il.datasets.dataset import Dataset
from er_il.datasets.decoding import decode_episode, read_encoded_episodes
from er_il.datasets.described import read_layout
from er_il.datasets.number_checks import check_numbers
from er_il.datasets.schema import DEMO_SEED, ENVIRONMENT_STATE, STATE
from er_il.datasets.wiring import Wiring
from er_il.evaluation.trace import Array, Trace
from er_il.spaces.action_space import ActionSpace
from er_il.spaces.layout import Layout, Part
from er_il.support.errors import DatasetError, UnknownNameError
from er_il.viewer.video import read_images

GRIPPER = "gripper"  # name of the opening in [0, 1] in what er_il records


def trace_of_episode(root: Path, number: int, arm: str = "", wirings: Sequence[Wiring] = ()) -> Trace:
    """Read an episode of a dataset; its task is unknown.

    Where the joints were not measured, the arm is shown at the decoded ones. A gripper that is not
    er_il's opening in [0, 1] is shown open.

    Args:
        root: Folder of a LeRobot v3 dataset.
        number: Number of the episode.
        arm: Label of the arm, where there are several.
        wirings: The arms of a dataset that does not know them; its actions are their joints.

    Raises:
        DatasetError: the folder is no such dataset, or has no such episode, or its numbers cannot be.
        UnknownNameError: it has no such arm.
    """
    dataset = Dataset(root)
    dataset, layout = read_layout(dataset, wirings)
    part = _part(layout, arm)
    if number not in dataset.episodes:
        raise DatasetError(
            f"{root} has no episode {number}. Valid: {min(dataset.episodes)} to {max(dataset.episodes)}."
        )
    check_numbers(dataset, layout, (ENVIRONMENT_STATE,), episode=number)
    rows = dataset.episodes[number]
    episodes = read_encoded_episodes(dataset, layout, dataset.joints_column(layout))
    episode = next(each for each in episodes if each.number == number)
    decoded = decode_episode(layout, episode)
    command = layout.angles(part, decoded.vectors)
    action = layout.split_encoded(episode.actions)[0][layout.parts.index(part)]
    spec = ActionSpace(part.space).spec()  # the trace has the gripper's opening beside the arm's action
    return Trace(
        task="",
        seed=int(dataset.column(DEMO_SEED)[rows.start, 0]) if DEMO_SEED in dataset.features else 0,
        period=1 / dataset.fps,
        label=" ".join(filter(None, (root.resolve().name, f"episode {number}", part.label))),
        outcome="",
        spec=spec | {"arm": spec["arm"] | arm_spec(part.space.arm)},
        q=command if episode.state is None else layout.angles(part, episode.state),
        gripper=_opening(dataset.names(STATE), _vectors(dataset, STATE, rows)),
        action=np.column_stack([action, _opening(layout.encoded_names, episode.actions)]),
        command=command,
        status=tuple(decoded.status[:, layout.parts.index(part)].tolist()),
        environment_state=_vectors(dataset, ENVIRONMENT_STATE, rows),
        environment_state_names=dataset.names(ENVIRONMENT_STATE),
        images=read_images(dataset, number, len(episode.actions)),
    )


def _part(layout: Layout, label: str) -> Part:
    """The arm of that label; without one, or by its own name, the only arm."""
    if len(layout.parts) == 1 and label in ("", layout.parts[0].space.arm.name):
        return layout.parts[0]
    labels = [part.label for part in layout.parts]
    if not label:
        raise DatasetError(f"The dataset has several arms: choose one with --arm. Valid: {', '.join(labels)}.")
    if label not in labels:
        raise UnknownNameError("arm", label, [part.label or part.space.arm.name for part in layout.parts])
    return layout.parts[labels.index(label)]


def _vectors(dataset: Dataset, column: str, rows: slice) -> Array:
    """Values (T, k) of a column in an episode; k = 0 if the dataset has no such column."""
    if column not in dataset.features:
        return np.zeros((rows.stop - rows.start, 0))
    return dataset.vectors(column)[rows].astype(np.float64)


def _opening(names: tuple[str, ...], vectors: Array) -> Array:
    """The gripper's opening (T,) in [0, 1] among named dimensions."""
    return vectors[:, names.index(GRIPPER)] if GRIPPER in names else np.ones(len(vectors))
