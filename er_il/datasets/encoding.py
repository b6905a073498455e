"""Re-encoding: the same LeRobot dataset with its actions in another space, its videos shared."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from lerobot.datasets.io_utils import load_info
from lerobot.datasets.utils import DatasetInfo
from numpy.typing import NDArray

from er_il.datasets.decoding import DecodedEpisode, Episode, decode_episodes
from er_il.datasets.normalisation import loosen_rotations
from er_il.datasets.rewriting import (
    Advance,
    Column,
    appearing,
    episode_slices,
    read_episode_numbers,
    read_vectors,
    rewrite,
)
from er_il.datasets.schema import LEADER_JOINTS, SOURCE_ACTION, STATE, Feature, action_feature, dimension_names
from er_il.spaces.joint import JOINT
from er_il.spaces.layout import Layout
from er_il.spaces.spec import ACTION, SPEC
from er_il.support.errors import DatasetError
from er_il.support.workers import cores

Floats = NDArray[np.float32]

VERSION = "v3."  # of LeRobot's format


def encode_dataset(
    source: Path,
    target: Path,
    layout: Layout,
    *,
    keep: bool = False,
    fit: bool = False,
    finish: Callable[[Path], None] = lambda folder: None,
    advance: Advance = lambda frames: None,
) -> None:
    """Write ``source`` again as ``target`` with its joint vectors encoded as actions by ``layout``.

    The joint vectors are those that were recorded, wherever the source holds them. Only the action
    column, its feature and its statistics differ, and they are what LeRobot would have written had
    the dataset been recorded in that space, but for :func:`er_il.datasets.normalisation.loosen_rotations`. The
    source stays as it is; the target appears only when complete.

    Args:
        source: Folder of a LeRobot v3 dataset.
        target: Folder that does not exist.
        layout: What the joint vectors mean and how to encode them.
        fit: Choose the signs of quaternions and turns of arm angles from the data.
        keep: Keep the joint vectors beside the encoded actions, in ``source.action``.
        finish: Called with the target's folder before it takes its name.
        advance: Called with the number of frames done since the last call.

    Raises:
        DatasetError: the source is no LeRobot v3 dataset, or does not hold joint vectors of this layout.
        FileExistsError: the target exists.
    """
    info = dataset_info(source)
    column = joints_column(info.features, layout)
    if column is None:
        raise DatasetError(
            "The dataset has no joint angles to encode: "
            f"none of {LEADER_JOINTS}, {SOURCE_ACTION} and {ACTION} is named {', '.join(layout.names)}."
        )
    vectors = read_vectors(source, column)
    layout = layout.fitted(vectors) if fit else layout
    with appearing(target) as partial:
        columns = {ACTION: _encoded(source, info, layout, vectors)}
        if keep and column == ACTION and layout.kind != JOINT:
            columns[SOURCE_ACTION] = Column(_kept(info.features[ACTION], layout), vectors)
        rewrite(source, partial, info, columns, advance)
        loosen_rotations(partial)
        finish(partial)


def decode_dataset(
    source: Path,
    target: Path,
    layout: Layout,
    *,
    finish: Callable[[Path], None] = lambda folder: None,
    advance: Advance = lambda frames: None,
) -> list[DecodedEpisode]:
    """Write ``source`` again with its encoded actions decoded to joint vectors, then encoded by ``layout``.

    Like :func:`encode_dataset`, but nothing of the source is read apart from its actions and the
    measured joints, where IK starts. Signs and turns are chosen from the data.

    Returns:
        What became of each episode.

    Raises:
        DatasetError: the source does not say what its actions mean.
        FileExistsError: the target exists.
    """
    info = dataset_info(source)
    encoded_by = dataset_layout(info.features)
    with appearing(target) as partial:
        decoded = decode_episodes(encoded_by, read_episodes(source, info, encoded_by), cores(), advance)
        vectors = np.concatenate([episode.vectors for episode in decoded]).astype(np.float32)
        rewrite(source, partial, info, {ACTION: _encoded(source, info, layout.fitted(vectors), vectors)})
        loosen_rotations(partial)
        finish(partial)
    return decoded


def dataset_info(dataset: Path) -> DatasetInfo:
    """Read the metadata of a LeRobot v3 dataset.

    Raises:
        DatasetError: it is none.
    """
    try:
        info = load_info(dataset)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise DatasetError(f"{dataset} is not a LeRobot v3 dataset: it has no meta/info.json.") from error
    except (TypeError, ValueError) as error:
        raise DatasetError(f"{dataset} is not a LeRobot v3 dataset: its meta/info.json is damaged.") from error
    if not info.codebase_version.startswith(VERSION):
        raise DatasetError(
            f"{dataset} is a LeRobot dataset of version {info.codebase_version}, not v3.0. Convert it first: "
            "python -m lerobot.scripts.convert_dataset_v21_to_v30."
        )
    if info.total_frames == 0 or ACTION not in info.features:
        raise DatasetError(f"{dataset} holds no actions.")
    return info


def dataset_layout(features: dict[str, Feature]) -> Layout:
    """Return what a dataset's actions mean.

    Raises:
        DatasetError: it does not say.
        SpecError: it says so in terms that this version does not read.
    """
    spec = (features[ACTION].get("info") or {}).get(SPEC)
    if spec is None:
        raise DatasetError(
            "The dataset does not say what its actions mean. Write it again so that it does, as it is or in another "
            "space: er-il encode DATASET --to joint --arm panda --out OUT."
        )
    return Layout.from_spec(spec)


def joints_column(features: dict[str, Feature], layout: Layout) -> str | None:
    """Name of the column that holds the joint vectors as recorded, if there is one."""
    for column in (LEADER_JOINTS, SOURCE_ACTION, ACTION):
        if column in features and dimension_names(features[column]) == layout.names:
            spec = (features[column].get("info") or {}).get(SPEC)
            if column != ACTION or spec is None or spec["space"] == JOINT:
                return column
    return None


def read_episodes(dataset: Path, info: DatasetInfo, layout: Layout, truth: str | None = None) -> list[Episode]:
    """Read the actions, the measured joints, and the column ``truth`` of joint vectors, if any."""
    numbers = read_episode_numbers(dataset)
    actions = read_vectors(dataset, ACTION).astype(np.float64)
    state = _measured(dataset, info, layout)
    vectors = None if truth is None else read_vectors(dataset, truth).astype(np.float64)
    return [
        Episode(
            int(numbers[rows.start]),
            actions[rows],
            state=None if state is None else state[rows],
            truth=None if vectors is None else vectors[rows],
        )
        for rows in episode_slices(numbers)
    ]


def _measured(dataset: Path, info: DatasetInfo, layout: Layout) -> NDArray[np.float64] | None:
    """Measured joint vectors (N, D), NaN in dimensions that belong to no arm; None unless all arms are measured."""
    names = dimension_names(info.features[STATE]) if STATE in info.features else ()
    if not all(part.motors.state and set(part.motors.state) <= set(names) for part in layout.parts):
        return None
    state = read_vectors(dataset, STATE)
    measured = np.full((len(state), len(layout.names)), np.nan)
    for part in layout.parts:
        measured[:, layout.indices(part)] = state[:, [names.index(name) for name in part.motors.state]]
    return measured


def _encoded(source: Path, info: DatasetInfo, layout: Layout, vectors: Floats) -> Column:
    """Encode joint vectors, an episode at a time so that rotations stay continuous within it."""
    episodes = [layout.encode(vectors[rows]) for rows in episode_slices(read_episode_numbers(source))]
    recorded = info.features[ACTION]
    feature = recorded | action_feature(layout)
    feature["info"] = (recorded.get("info") or {}) | feature["info"]
    return Column(feature, np.concatenate(episodes).astype(np.float32))


def _kept(recorded: Feature, layout: Layout) -> Feature:
    return recorded | {"dtype": "float32", "names": list(layout.names), "info": None}
