"""Verification of an encoded dataset: round-trip errors, singularities, and sanity checks of its joint values."""

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_il.datasets.dataset import Dataset
from er_il.datasets.decoding import DecodedEpisode, EncodedEpisode, decode_episodes, read_encoded_episodes
from er_il.datasets.described import read_layout
from er_il.datasets.integrity import check_whole
from er_il.datasets.number_checks import Problems, number_problems
from er_il.datasets.pose_check import JointValues, PoseCheck, check_poses
from er_il.datasets.pose_columns import named_poses, possible_poses
from er_il.datasets.sanity_checks import JointSample, check_joint_values
from er_il.datasets.schema import STATE
from er_il.datasets.selection import selected
from er_il.datasets.wiring import Wiring
from er_il.kinematics.goal import POSITION_TOLERANCE, ROTATION_TOLERANCE
from er_il.kinematics.rotation import Quaternion
from er_il.kinematics.search import at_limits
from er_il.kinematics.solver import Status
from er_il.spaces.joint_choice import singular_intervals
from er_il.spaces.layout import Layout, Part
from er_il.spaces.pose import POSITION_NAMES, TASK, PoseSpace
from er_il.spaces.round_trip import EXACT, SINGULAR
from er_il.support.series import percentiles

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

PERCENTILES = (50, 95, 99, 100)
PROMISED = 2.0  # the tolerances of the decoder within which task space returns a pose: encoding rounds, too


@dataclass(frozen=True, eq=False)
class CheckedEpisode:
    """Round-trip errors of one episode of T frames for P arms."""

    number: int
    status: NDArray[np.str_]  # (T, P)
    error: Array  # (T, P) [rad] largest joint error of the round trip; NaN without the joint vectors
    flagged: Flags  # (T, P) the decoder's status, a joint at its limit or a singularity says that it may not be exact
    conditioning: Array  # (T, P)
    position_error: Array  # (T, P) [m]
    rotation_error: Array  # (T, P) [rad]
    broken: Flags  # (T, P) not flagged, and yet the decoder does not return what the space promises


@dataclass(frozen=True, eq=False)
class Verification:
    """Results of decoding a dataset and comparing with its joint vectors."""

    layout: Layout
    episodes: tuple[CheckedEpisode, ...]
    compared: bool  # True if the dataset holds the joint vectors to compare with
    findings: dict[str, str]  # arm -> what is wrong with its joint values
    other_side: dict[str, float]  # arm -> share of quaternions beyond the hemisphere of their reference
    problems: Problems  # numbers that cannot be
    poses: dict[str, PoseCheck] = field(default_factory=dict)  # arm -> its recorded poses against its joints

    @property
    def arms(self) -> tuple[str, ...]:
        """Names of the arms."""
        return tuple(part.label or part.space.arm.name for part in self.layout.parts)

    def gathered(self, name: str, unflagged: bool = False) -> list[Array]:
        """Values of all frames, an array an arm."""
        return [
            np.concatenate(
                [
                    getattr(each, name)[:, arm][~each.flagged[:, arm] if unflagged else slice(None)]
                    for each in self.episodes
                ]
            )
            for arm in range(len(self.arms))
        ]

    def invalid(self) -> dict[int, dict[str, int]]:
        """Frames by status, of the episodes in which not all are ok."""
        counts = {each.number: Counter(each.status.ravel().tolist()) for each in self.episodes}
        return {
            number: {status: count for status, count in counter.items() if status != Status.OK}
            for number, counter in counts.items()
            if set(counter) != {Status.OK}
        }

    def broken(self) -> Problems:
        """What is not as the specification promises: numbers that cannot be, round trips that are not exact."""
        found = {number: list(texts) for number, texts in self.problems.items()}
        for each in self.episodes:
            for arm, label in enumerate(self.arms):
                if count := int(each.broken[:, arm].sum()):
                    found.setdefault(each.number, []).append(f"{label} does not come back in {count} frames")
        return dict(sorted(found.items()))

    def report(self) -> dict[str, Any]:
        """Everything as JSON."""
        arms = {}
        for arm, label in enumerate(self.arms):
            error, clear = self.gathered("error")[arm], self.gathered("error", unflagged=True)[arm]
            arms[label] = {
                "space": self.layout.kind,
                "joint_error": percentiles(error, PERCENTILES) if self.compared else None,
                "joint_error_unflagged": percentiles(clear, PERCENTILES) if self.compared else None,
                "position_error": percentiles(self.gathered("position_error")[arm], PERCENTILES),
                "rotation_error": percentiles(self.gathered("rotation_error")[arm], PERCENTILES),
                "flagged": int(sum(each.flagged[:, arm].sum() for each in self.episodes)),
                "broken": int(sum(each.broken[:, arm].sum() for each in self.episodes)),
                "quaternions_other_side": self.other_side.get(label, 0.0),
                "finding": self.findings.get(label, ""),
            }
            if label in self.poses:
                arms[label]["poses"] = self.poses[label].report()
        return {
            "frames": sum(len(each.status) for each in self.episodes),
            "episodes": len(self.episodes),
            "arms": arms,
            "invalid_by_episode": self.invalid(),
            "broken_by_episode": self.broken(),
            "near_singularity": [
                {"episode": each.number, "arm": label} | vars(interval)
                for each in self.episodes
                for arm, label in enumerate(self.arms)
                for interval in singular_intervals(each.conditioning[:, arm])
            ],
        }


def read_whole(root: Path, wirings: Sequence[Wiring] = (), chosen: Collection[int] = ()) -> tuple[Dataset, Layout]:
    """A dataset whose files are whole, and the layout of its actions.

    Args:
        root: Folder of a dataset.
        wirings: The arms of a dataset that does not know them; its actions are their joints.
        chosen: Numbers of the episodes to look at; all if empty.

    Raises:
        ErIlError: nothing says what its actions mean, it is no dataset, or has no such episode.
    """
    dataset = Dataset(root)
    check_whole(dataset)
    dataset, layout = read_layout(dataset, wirings)
    return selected(dataset, chosen), layout


def verify(
    dataset: Dataset,
    layout: Layout,
    workers: int,
    on_progress: Callable[[int, int], object],
    poses: Sequence[str] = (),
) -> Verification:
    """Decode a dataset's actions and compare them with the joint vectors that were encoded.

    Seeds are the measured joints where the state has them, as on the robot, else the joint vector of
    the step before.

    Args:
        dataset: The dataset, such as :func:`read_whole` gives.
        layout: The layout of its actions.
        workers: Number of worker processes.
        on_progress: Called with the number of frames done, and their total.
        poses: Column that holds end-effector poses, then their dimensions in it; found by their names and values if
            omitted.

    Raises:
        ErIlError: it has no such column, or is damaged.
    """
    truth = dataset.joints_column(layout)
    episodes = read_encoded_episodes(dataset, layout, truth)
    problems = number_problems(dataset, layout)
    compared = _poses(dataset, layout, episodes, poses)
    findings = _findings(dataset, layout, episodes, compared)
    done = 0

    def advance(frames: int) -> None:
        nonlocal done
        done += frames
        on_progress(done, dataset.frames)

    decoded = decode_episodes(layout, episodes, workers, advance)
    checked = tuple(check_episode(layout, *each) for each in zip(episodes, decoded, strict=True))
    return Verification(layout, checked, truth is not None, findings, _other_side(layout, episodes), problems, compared)


def check_episode(layout: Layout, episode: EncodedEpisode, decoded: DecodedEpisode) -> CheckedEpisode:
    """Compare what an episode decodes to with what was encoded."""
    error = np.full(decoded.status.shape, np.nan)
    at_limit = np.empty(decoded.status.shape, dtype=bool)
    for p, part in enumerate(layout.parts):
        q, arm = layout.angles(part, decoded.vectors), part.space.arm
        at_lower, at_upper = at_limits(arm, q)
        at_limit[:, p] = np.any(at_lower | at_upper, axis=1)
        if episode.truth is not None:
            error[:, p] = np.abs(q - layout.angles(part, episode.truth)).max(axis=1)
    flagged = (decoded.status != Status.OK) | (decoded.conditioning < SINGULAR) | at_limit
    kept = np.stack([_kept(layout, part, episode, decoded, error[:, p]) for p, part in enumerate(layout.parts)], axis=1)
    return CheckedEpisode(
        episode.number,
        decoded.status,
        error,
        flagged,
        decoded.conditioning,
        decoded.position_error,
        decoded.rotation_error,
        ~(flagged | kept),
    )


def _kept(layout: Layout, part: Part, episode: EncodedEpisode, decoded: DecodedEpisode, error: Array) -> Flags:
    """Frames (T,) that decode to what a space promises: the joints that were encoded; task space, their pose."""
    if episode.truth is None:
        return np.ones(len(error), dtype=bool)
    if not part.space.kind.endswith(TASK):
        return error <= EXACT
    found, meant = (
        part.space.kinematics.fk_batch(layout.angles(part, vectors)) for vectors in (decoded.vectors, episode.truth)
    )
    turn = np.einsum("tij,tij->t", found[:, :3, :3], meant[:, :3, :3])  # trace of the relative rotation
    angle = np.arccos(np.clip((turn - 1) / 2, -1.0, 1.0))
    apart = np.linalg.norm(found[:, :3, 3] - meant[:, :3, 3], axis=1)
    return (apart <= PROMISED * POSITION_TOLERANCE) & (angle <= PROMISED * ROTATION_TOLERANCE)


def _other_side(layout: Layout, episodes: list[EncodedEpisode]) -> dict[str, float]:
    """Share of quaternions beyond their hemisphere, where another episode may have them with the other sign."""
    found = {}
    for part in layout.parts:
        if isinstance(part.space, PoseSpace) and isinstance(part.space.rotation, Quaternion):
            first = layout.encoded_names.index(part.names[len(POSITION_NAMES)])
            quaternions = np.concatenate([each.actions[:, first : first + 4] for each in episodes])
            found[part.label or part.space.arm.name] = float((quaternions @ part.space.rotation.reference < 0).mean())
    return found


def _findings(
    dataset: Dataset, layout: Layout, episodes: list[EncodedEpisode], poses: dict[str, PoseCheck]
) -> dict[str, str]:
    """Check the joint values of each arm, measured ones where an end effector was measured with them."""
    recorded, measured = _vectors(episodes)
    vectors = recorded if recorded is not None else measured
    if vectors is None:
        return {}
    found = {}
    for part in layout.parts:
        name = part.label or part.space.arm.name
        positions = None if measured is None else _measured_positions(dataset, part.label)
        values = (vectors if positions is None or measured is None else measured)[:, layout.indices(part)]
        text = check_joint_values(JointSample(part.space.arm, part.motors, values, positions))
        if name in poses and poses[name].certain and (poses[name].cause or not text):
            text = poses[name].finding()
        if text:
            found[name] = text
    return found


def _poses(
    dataset: Dataset, layout: Layout, episodes: list[EncodedEpisode], named: Sequence[str]
) -> dict[str, PoseCheck]:
    """Compare the recorded poses of each arm with its joints, where there are any."""
    chosen = named_poses(dataset, named) if named else None
    vectors = zip(_vectors(episodes), (False, True), strict=True)
    known = [(each, measured) for each, measured in vectors if each is not None]
    found = {}
    for part in layout.parts:
        others = {each.label: layout.indices(each) for each in layout.parts if each is not part}
        joints = [
            JointValues(part.space.arm, part.motors, each[:, layout.indices(part)], measured)
            for each, measured in known
        ]
        mixed = {label: known[-1][0][:, indices] for label, indices in others.items()} if known else {}
        places = list(possible_poses(dataset, part.label, list(others))) if chosen is None else chosen
        if check := check_poses(places, joints, mixed):
            found[part.label or part.space.arm.name] = check
    return found


def _vectors(episodes: list[EncodedEpisode]) -> tuple[Array | None, Array | None]:
    """Joint vectors (N, D) of all episodes that were commanded and measured, as far as they are known."""
    recorded = None if episodes[0].truth is None else np.concatenate([np.asarray(each.truth) for each in episodes])
    measured = None if episodes[0].state is None else np.concatenate([np.asarray(each.state) for each in episodes])
    return recorded, measured


def _measured_positions(dataset: Dataset, label: str) -> Array | None:
    names = dataset.names(STATE)
    for prefix in (f"{label}_", f"{label}.") if label else ("",):
        if all(prefix + name in names for name in POSITION_NAMES):
            columns = [names.index(prefix + name) for name in POSITION_NAMES]
            return dataset.vectors(STATE)[:, columns].astype(np.float64)
    return None
