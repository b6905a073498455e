"""Re-encoding: the same LeRobot dataset with its actions in another space, its videos shared."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from er_il.datasets.dataset import Dataset, Floats
from er_il.datasets.decoding import DecodedEpisode, decode_episodes, read_encoded_episodes
from er_il.datasets.normalisation import normalise_actions
from er_il.datasets.rewriting import Advance, Column, Copy, rewrite
from er_il.datasets.schema import LEADER_JOINTS, SOURCE_ACTION, Feature, action_feature
from er_il.spaces.joint import JOINT
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
        keep: Keep the joint vectors beside the encoded actions, in ``source.action``.
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
    with atomic_folder(target) as partial:
        copies = {}
        if keep and column == ACTION and layout.commands != JOINT:
            copies[SOURCE_ACTION] = Copy(_kept(source.features[ACTION], layout), ACTION)
        rewrite(source, partial, {ACTION: _encoded(source, layout, vectors)}, copies, advance)
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
        rewrite(source, partial, {ACTION: _encoded(source, layout.fitted(vectors), vectors)}, {})
        normalise_actions(partial)
        finish(partial)
    return decoded


def _encoded(source: Dataset, layout: Layout, vectors: Floats) -> Column:
    """Encode joint vectors, an episode at a time so that rotations stay continuous within it."""
    episodes = [layout.encode(vectors[rows]).astype(np.float32) for rows in source.episodes.values()]
    recorded = source.features[ACTION]
    feature = recorded | action_feature(layout)
    feature["info"] = (recorded.get("info") or {}) | feature["info"]
    return Column(feature, np.concatenate(episodes))


def _kept(recorded: Feature, layout: Layout) -> Feature:
    return recorded | {"names": list(layout.names), "info": None}
