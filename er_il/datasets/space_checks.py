"""What the joint values of a dataset would come back as from each action space, before one is chosen."""

from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from er_il.datasets.dataset import Dataset
from er_il.datasets.decoding import decode_episodes, read_encoded_episodes
from er_il.datasets.described import read_layout
from er_il.datasets.selection import selected
from er_il.datasets.verification import Verification, check_episode
from er_il.datasets.wiring import Wiring
from er_il.kinematics.rotation import Quaternion
from er_il.spaces.layout import Layout
from er_il.spaces.pose import TASK
from er_il.spaces.registry import REDUNDANCIES
from er_il.support.errors import ArmError

KINDS = (TASK, *REDUNDANCIES)


def verify_in_spaces(
    root: Path,
    workers: int,
    on_progress: Callable[[int, int], object],
    wirings: Sequence[Wiring] = (),
    chosen: Collection[int] = (),
) -> dict[str, Verification]:
    """Encode a dataset of joints in each space that its arms have, and decode it, without writing anything.

    Args:
        root: Folder of a dataset whose actions are joints.
        workers: Number of worker processes.
        on_progress: Called with the number of frames done, and their total.
        wirings: The arms of a dataset that does not know them.
        chosen: Numbers of the episodes to look at; all if empty.
    """
    dataset = Dataset(root)
    dataset, layout = read_layout(dataset, wirings)
    dataset = selected(dataset, chosen)
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
