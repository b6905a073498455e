"""Decoding whole episodes of encoded vectors, several episodes at a time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from er_il.datasets.dataset import Dataset
from er_il.kinematics.solver import Status
from er_il.spaces.layout import Layout
from er_il.spaces.spec import ACTION
from er_il.support.workers import StatefulWorkers

Array = NDArray[np.float64]

FEW_FRAMES = 4000  # fewer are decoded sooner than worker processes start


@dataclass(frozen=True, eq=False)
class EncodedEpisode:
    """T encoded vectors, with the joint vectors of the same steps where they are known."""

    number: int
    actions: Array  # (T, layout's encoded dimensions)
    state: Array | None = None  # (T, D) measured joint vectors; NaN where nothing was measured
    truth: Array | None = None  # (T, D) the joint vectors that were encoded


@dataclass(frozen=True, eq=False)
class DecodedEpisode:
    """T decoded vectors of P arms, and the quality of each decode."""

    vectors: Array  # (T, D)
    status: NDArray[np.str_]  # (T, P) of er_il.Status
    position_error: Array  # (T, P) [m] of the pose
    rotation_error: Array  # (T, P) [rad]
    conditioning: Array  # (T, P) smallest singular value, see Kinematics.conditioning; infinite in joint space


def decode_episode(layout: Layout, episode: EncodedEpisode) -> DecodedEpisode:
    """Decode an episode in time order.

    Seeds are the measured joints, as on a robot; without them the joint vector of the step before.
    """
    length, parts = len(episode.actions), len(layout.parts)
    result = DecodedEpisode(
        np.empty((length, len(layout.names))),
        np.full((length, parts), Status.OK, dtype="U16"),
        np.zeros((length, parts)),
        np.zeros((length, parts)),
        np.full((length, parts), np.inf),
    )
    last = home_vector(layout) if episode.truth is None else episode.truth[0]
    if episode.truth is None and episode.state is not None:
        last = episode.state[0]
    for t, action in enumerate(episode.actions):
        decoded = layout.decode(action, last if episode.state is None else episode.state[t], last)
        result.vectors[t] = decoded.vector
        last = decoded.vector if episode.truth is None else episode.truth[t]
        for p, (part, arm) in enumerate(zip(layout.parts, decoded.parts, strict=True)):
            result.status[t, p] = arm.status
            result.position_error[t, p], result.rotation_error[t, p] = arm.pos_err, arm.rot_err
            result.conditioning[t, p] = part.space.conditioning(layout.angles(part, last))
    return result


def decode_episodes(
    layout: Layout,
    episodes: Sequence[EncodedEpisode],
    workers: int,
    advance: Callable[[int], object] = lambda frames: None,
) -> list[DecodedEpisode]:
    """Decode episodes, in worker processes if they are long; ``advance`` is told how many frames are done."""
    frames = sum(len(episode.actions) for episode in episodes)
    decoded = []
    with StatefulWorkers(workers if frames > FEW_FRAMES else 1, partial(Layout.from_spec, layout.spec())) as pool:
        for result in [pool.submit(decode_episode, episode) for episode in episodes]:
            decoded.append(result())
            advance(len(decoded[-1].vectors))
    return decoded


def read_encoded_episodes(dataset: Dataset, layout: Layout, truth: str | None = None) -> list[EncodedEpisode]:
    """Read the episodes of a dataset: actions, measured joints, and the column ``truth`` of joint vectors, if any."""
    actions = dataset.vectors(ACTION).astype(np.float64)
    state = dataset.measured_joints(layout)
    vectors = None if truth is None else dataset.vectors(truth).astype(np.float64)
    return [
        EncodedEpisode(
            number,
            actions[rows],
            state=None if state is None else state[rows],
            truth=None if vectors is None else vectors[rows],
        )
        for number, rows in dataset.episodes.items()
    ]


def home_vector(layout: Layout) -> Array:
    """The joint vector (D,) of all arms at home, zero elsewhere."""
    vector = np.zeros(len(layout.names))
    for part in layout.parts:
        vector[layout.indices(part)] = part.motors.values(part.space.arm.home)
    return vector
