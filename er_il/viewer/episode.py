"""An episode of a dataset as a trace: each action decoded from the measured joints, images and all."""

from pathlib import Path

import numpy as np
from lerobot.datasets.utils import DatasetInfo

from er_il.arms.portable import arm_spec
from er_il.datasets.decoding import decode_episode
from er_il.datasets.encoding import dataset_info, dataset_layout, joints_column, read_episodes
from er_il.datasets.rewriting import episode_slices, read_episode_numbers, read_vectors
from er_il.datasets.schema import DEMO_SEED, ENVIRONMENT_STATE, STATE, dimension_names
from er_il.evaluation.trace import Array, Trace
from er_il.spaces.action_space import ActionSpace
from er_il.spaces.layout import Layout, Part
from er_il.support.errors import DatasetError, UnknownNameError
from er_il.viewer.column import DATA, read_rows
from er_il.viewer.video import read_images

GRIPPER = "gripper"  # name of the opening in [0, 1] in what er_il records


def trace_of_episode(dataset: Path, number: int, arm: str = "") -> Trace:
    """Read an episode of a dataset; its task is unknown.

    Where the joints were not measured, the arm is shown at the decoded ones. A gripper that is not
    er_il's opening in [0, 1] is shown open.

    Args:
        dataset: Folder of a LeRobot v3 dataset that says what its actions mean.
        number: Number of the episode.
        arm: Label of the arm, where there are several.

    Raises:
        DatasetError: the folder is no such dataset, or has no such episode.
        UnknownNameError: it has no such arm.
    """
    info = dataset_info(dataset)
    layout = dataset_layout(info.features)
    part = _part(layout, arm)
    episodes = read_episodes(dataset, info, layout, joints_column(info.features, layout))
    rows = dict(zip((each.number for each in episodes), episode_slices(read_episode_numbers(dataset)), strict=True))
    if number not in rows:
        raise DatasetError(f"{dataset} has no episode {number}. Valid: {min(rows)} to {max(rows)}.")
    episode = next(each for each in episodes if each.number == number)
    decoded = decode_episode(layout, episode)
    command = layout.angles(part, decoded.vectors)
    state_names, state = _vectors(dataset, info, STATE, rows[number])
    environment_state_names, environment_state = _vectors(dataset, info, ENVIRONMENT_STATE, rows[number])
    action = layout.split_encoded(episode.actions)[0][layout.parts.index(part)]
    spec = ActionSpace(part.space).spec()  # the trace has the gripper's opening beside the arm's action
    return Trace(
        task="",
        seed=_seed(dataset, number) if DEMO_SEED in info.features else 0,
        period=1 / info.fps,
        label=" ".join(filter(None, (dataset.resolve().name, f"episode {number}", part.label))),
        outcome="",
        spec=spec | {"arm": spec["arm"] | arm_spec(part.space.arm)},
        q=command if episode.state is None else layout.angles(part, episode.state),
        gripper=_opening(state_names, state),
        action=np.column_stack([action, _opening(layout.encoded_names, episode.actions)]),
        command=command,
        status=tuple(decoded.status[:, layout.parts.index(part)].tolist()),
        environment_state=environment_state,
        environment_state_names=environment_state_names,
        images=read_images(dataset, info, number, len(episode.actions)),
    )


def _part(layout: Layout, label: str) -> Part:
    """The arm of that label; without one, the only arm."""
    if not label and len(layout.parts) == 1:
        return layout.parts[0]
    labels = [part.label for part in layout.parts]
    if not label:
        raise DatasetError(f"The dataset has several arms: choose one with --arm. Valid: {', '.join(labels)}.")
    if label not in labels:
        raise UnknownNameError("arm", label, filter(None, labels))
    return layout.parts[labels.index(label)]


def _seed(dataset: Path, number: int) -> int:
    return int(np.squeeze(read_rows(dataset, DATA, (DEMO_SEED,), number)[0][DEMO_SEED]))


def _vectors(dataset: Path, info: DatasetInfo, column: str, rows: slice) -> tuple[tuple[str, ...], Array]:
    """Names and values (T, k) of a column in an episode; k = 0 if the dataset has no such column."""
    if column not in info.features:
        return (), np.zeros((rows.stop - rows.start, 0))
    return dimension_names(info.features[column]), read_vectors(dataset, column)[rows].astype(np.float64)


def _opening(names: tuple[str, ...], vectors: Array) -> Array:
    """The gripper's opening (T,) in [0, 1] among named dimensions."""
    return vectors[:, names.index(GRIPPER)] if GRIPPER in names else np.ones(len(vectors))
