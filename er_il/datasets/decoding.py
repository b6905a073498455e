"""Decoding whole episodes of encoded vectors, several episodes at a time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from er_il.datasets.dataset import Dataset
from er_il.kinematics.solver import BatchResult
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
    """Decode an episode.

    Seeds are the measured joints, as on a robot; without them the joint vector of the step before, which is decoded
    first where it is not known.
    """
    decode = _decode_in_turn if _depends(layout, episode) else _decode_at_once
    vectors, results = decode(layout, episode)
    at = vectors if episode.truth is None else episode.truth
    conditioning = [part.space.conditionings(layout.angles(part, at)) for part in layout.parts]
    return DecodedEpisode(
        vectors,
        np.stack([result.status for result in results], axis=1),
        np.stack([result.pos_err for result in results], axis=1),
        np.stack([result.rot_err for result in results], axis=1),
        np.stack(conditioning, axis=1),
    )


def _depends(layout: Layout, episode: EncodedEpisode) -> bool:
    """True if a step can be decoded after the one before only: its seed or last command is what that decodes to."""
    counted = episode.state is None or any(part.space.relative for part in layout.parts)
    return episode.truth is None and counted


def _decode_at_once(layout: Layout, episode: EncodedEpisode) -> tuple[Array, list[BatchResult]]:
    """Decode all steps in a batch."""
    commands = episode.state if episode.truth is None else np.concatenate([episode.truth[:1], episode.truth[:-1]])
    assert commands is not None
    return layout.decode_batch(episode.actions, commands if episode.state is None else episode.state, commands)


def _decode_in_turn(layout: Layout, episode: EncodedEpisode) -> tuple[Array, list[BatchResult]]:
    """Decode in time order, each step from the joint vector of the last."""
    last = home_vector(layout) if episode.state is None else episode.state[0]
    steps = []
    for t, action in enumerate(episode.actions):
        steps.append(layout.decode(action, last if episode.state is None else episode.state[t], last))
        last = steps[-1].vector
    return np.array([step.vector for step in steps]), [
        BatchResult.of(part) for part in zip(*(step.parts for step in steps), strict=True)
    ]


def decode_episodes(
    layout: Layout,
    episodes: Sequence[EncodedEpisode],
    workers: int,
    advance: Callable[[int], object] = lambda frames: None,
) -> list[DecodedEpisode]:
    """Decode episodes, in worker processes if they are long and their steps depend on one another.

    Args:
        layout: What the vectors mean.
        episodes: The episodes.
        workers: Number of worker processes.
        advance: Called with the number of frames done since the last call.
    """
    frames = sum(len(episode.actions) for episode in episodes if _depends(layout, episode))
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
