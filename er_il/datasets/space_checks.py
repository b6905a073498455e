"""What the joint values of a dataset would come back as from each action space, before one is chosen."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from er_il.datasets.dataset import Dataset
from er_il.datasets.decoding import decode_episodes, read_encoded_episodes
from er_il.datasets.verification import Verification, check_episode
from er_il.kinematics.rotation import Quaternion
from er_il.spaces.layout import Layout
from er_il.spaces.pose import TASK
from er_il.spaces.registry import REDUNDANCIES
from er_il.support.errors import ArmError

KINDS = (TASK, *REDUNDANCIES)


def verify_in_spaces(
    dataset: Dataset, layout: Layout, workers: int, on_progress: Callable[[int, int], object]
) -> dict[str, Verification]:
    """Encode a dataset of joints in each space that its arms have, and decode it, without writing anything.

    Args:
        dataset: A dataset whose actions are joints, such as :func:`er_il.datasets.verification.read_whole` gives.
        layout: The layout of its actions.
        workers: Number of worker processes.
        on_progress: Called with the number of frames done, and their total.
    """
    episodes = read_encoded_episodes(dataset, layout, dataset.joints_column(layout))
    truths = [np.asarray(episode.truth) for episode in episodes]
    spaces = _spaces(layout)
    done = 0

    def advance(frames: int) -> None:
        nonlocal done
        done += frames
        on_progress(done, len(spaces) * dataset.frames)

    found = {}
    for kind, space in spaces.items():
        fitted = space.fitted(np.concatenate(truths))
        encoded = [replace(each, actions=fitted.encode(q)) for each, q in zip(episodes, truths, strict=True)]
        decoded = decode_episodes(fitted, encoded, workers, advance)
        checked = tuple(check_episode(fitted, *each) for each in zip(encoded, decoded, strict=True))
        found[kind] = Verification(fitted, checked, compared=True, findings={}, other_side={}, problems={})
    return found


def _spaces(layout: Layout) -> dict[str, Layout]:
    """The layout in each space; an arm without redundancy has task space alone."""
    found = {}
    for kind in KINDS:
        with suppress(ArmError):
            found[kind] = layout.in_space(kind, Quaternion.kind)
    return found
