"""The joint angles in a dataset, arm by arm and episode by episode, whatever its action space."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from er_il.arms.arm import Arm
from er_il.datasets.dataset import Dataset
from er_il.datasets.decoding import EncodedEpisode, decode_episodes, read_encoded_episodes
from er_il.datasets.described import read_layout
from er_il.datasets.number_checks import check_numbers
from er_il.datasets.wiring import Wiring
from er_il.spaces.base import Array
from er_il.spaces.layout import Layout


@dataclass(frozen=True, eq=False)
class JointPath:
    """One episode of one arm, T steps."""

    episode: int
    commanded: Array  # (T, n) [rad]
    measured: Array  # (T, n) [rad] what was commanded the step before, where nothing was measured


@dataclass(frozen=True, eq=False)
class ArmPaths:
    """All episodes of one arm."""

    label: str  # "" where there is but one arm
    arm: Arm
    paths: tuple[JointPath, ...]

    def spread(self, count: int) -> tuple[JointPath, ...]:
        """At most ``count`` of the episodes, spread evenly from the first to the last."""
        chosen = sorted({round(i * (len(self.paths) - 1) / max(1, count - 1)) for i in range(count)})
        return tuple(self.paths[i] for i in chosen)


def read_joint_paths(root: Path, wirings: Sequence[Wiring] = (), workers: int = 1) -> list[ArmPaths]:
    """Read the joint angles of each arm of a dataset.

    Args:
        root: Folder of the dataset.
        wirings: The arms of a dataset that does not know them.
        workers: Processes that decode, where the joints were not kept beside the encoded actions.

    Raises:
        ErIlError: it is no dataset, or does not say which arm it is of and nor do the wirings, or its
            numbers cannot be.
    """
    dataset = Dataset(root)
    dataset, layout = read_layout(dataset, wirings)
    check_numbers(dataset, layout)
    episodes = read_encoded_episodes(dataset, layout, dataset.joints_column(layout))
    vectors = joint_vectors(layout, episodes, workers)
    found = []
    for part in layout.parts:
        paths = []
        for episode, vector in zip(episodes, vectors, strict=True):
            commanded = layout.angles(part, vector)
            before = np.concatenate([commanded[:1], commanded[:-1]])
            measured = before if episode.state is None else layout.angles(part, episode.state)
            paths.append(JointPath(episode.number, commanded, measured))
        found.append(ArmPaths(part.label, part.space.arm, tuple(paths)))
    return found


def joint_vectors(layout: Layout, episodes: Sequence[EncodedEpisode], workers: int) -> list[Array]:
    """The joint vectors (T, D) of each episode: those that were recorded, or else decoded.

    Args:
        layout: What the episodes' vectors mean.
        episodes: All of one dataset.
        workers: Processes that decode.
    """
    if any(episode.truth is None for episode in episodes):
        return [decoded.vectors for decoded in decode_episodes(layout, episodes, workers)]
    return [np.asarray(episode.truth) for episode in episodes]
