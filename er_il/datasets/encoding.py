"""Re-encoding: the same LeRobot dataset with its actions in another space, its videos shared."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from er_il.datasets.dataset import Dataset, Floats
from er_il.datasets.decoding import DecodedEpisode, decode_episodes, read_encoded_episodes
from er_il.datasets.normalisation import normalise_actions
from er_il.datasets.rewriting import Advance, Column, rewrite
from er_il.datasets.schema import LEADER_JOINTS, SOURCE_ACTION, action_feature
from er_il.datasets.source_columns import (
    RECORDED,
    SourceColumns,
    columns_to_keep,
    columns_to_restore,
    recorded_action,
)
from er_il.spaces.layout import Layout
from er_il.spaces.spec import ACTION
from er_il.support.atomic_files import atomic_folder
from er_il.support.errors import DatasetError
from er_il.support.workers import cores


def encode_dataset(
    source: Dataset,
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
    the dataset been recorded in that space, but for :func:`er_il.datasets.normalisation.normalise_actions`. The
    source stays as it is; the target appears only when complete.

    Args:
        source: The dataset.
        target: Folder that does not exist.
        layout: What the joint vectors mean and how to encode them.
        fit: Choose the signs of quaternions and turns of arm angles from the data.
        keep: Keep what the actions replace, see :func:`er_il.datasets.source_columns.columns_to_keep`.
        finish: Called with the target's folder before it takes its name.
        advance: Called with the number of frames done since the last call.

    Raises:
        DatasetError: the source is no LeRobot v3 dataset, or does not hold joint vectors of this layout.
        FileExistsError: the target exists.
    """
    column = source.joints_column(layout)
    if column is None:
        raise DatasetError(
            "The dataset has no joint angles to encode: "
            f"none of {LEADER_JOINTS}, {SOURCE_ACTION} and {ACTION} is named {', '.join(layout.names)}."
        )
    vectors = source.vectors(column)
    layout = layout.fitted(vectors) if fit else layout
    kept = columns_to_keep(source, layout, column, vectors, keep)
    columns = {**kept.columns, ACTION: _encoded(source, layout, vectors)}
    with atomic_folder(target) as partial:
        rewrite(source, partial, columns, kept.copies, kept.dropped, advance)
        normalise_actions(partial)
        finish(partial)


def decode_dataset(
    source: Dataset,
    target: Path,
    layout: Layout,
    *,
    finish: Callable[[Path], None] = lambda folder: None,
    advance: Advance = lambda frames: None,
) -> list[DecodedEpisode]:
    """Write ``source`` again with its encoded actions decoded to joint vectors, then encoded by ``layout``.

    In joint space, the actions' feature and the columns that encoding took away are again what they were before
    (:func:`er_il.datasets.source_columns.columns_to_restore`).

    Like :func:`encode_dataset`, but nothing of the source is read apart from its actions and the
    measured joints, where IK starts. Signs and turns are chosen from the data.

    Returns:
        What became of each episode.

    Raises:
        DatasetError: the source does not say what its actions mean.
        FileExistsError: the target exists.
    """
    encoded_by = source.layout
    with atomic_folder(target) as partial:
        decoded = decode_episodes(encoded_by, read_encoded_episodes(source, encoded_by), cores(), advance)
        vectors = np.concatenate([episode.vectors for episode in decoded]).astype(np.float32)
        actions = _encoded(source, layout.fitted(vectors), vectors)
        restored = SourceColumns()
        if found := columns_to_restore(source, layout):
            feature, restored = found
            actions = Column(feature, actions.values)
        rewrite(source, partial, {ACTION: actions}, restored.copies, restored.dropped)
        if not found:  # joints as they were recorded have LeRobot's own statistics
            normalise_actions(partial)
        finish(partial)
    return decoded


def _encoded(source: Dataset, layout: Layout, vectors: Floats) -> Column:
    """Encode joint vectors, an episode at a time so that rotations stay continuous within it."""
    episodes = [layout.encode(vectors[rows]).astype(np.float32) for rows in source.episodes.values()]
    recorded = source.features[ACTION]
    feature = action_feature(layout, recorded)
    before = recorded_action(source)
    feature["info"] = feature["info"] | ({RECORDED: before} if before else {})
    return Column(feature, np.concatenate(episodes))
