"""How much the elbow differs between episodes where the end effector is at the same pose.

At the same pose, joints differ by self-motion only. Of the difference dq between two frames with nearly the same pose,
N dq is therefore the part that the pose does not determine; N has an orthonormal basis of the self-motion in its rows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from er_il.arms.arm import Arm, Vector
from er_il.evaluation.task_drift import arm_points
from er_il.kinematics.self_motion import extents, self_motions
from er_il.kinematics.solver import kinematics_of

Array = NDArray[np.float64]

LENGTH = 0.2  # [m] by which a radian of the end effector's rotation counts
NEAR = 0.03  # [m] poses no farther apart are the same
SOON = 0.1  # of an episode's duration: frames no farther apart are at the same time
FRAMES = 600  # frames at most whose neighbours are looked for
MEASURED = 40  # frames at most whose self-motion is walked along
STEP = 1e-3  # [rad] of the finite difference that says how far a radian of self-motion moves the arm


@dataclass(frozen=True, eq=False)
class ElbowSpread:
    """Pairs of frames at the same pose, of two episodes each, and how far self-motion could go."""

    frames: int  # that were looked at
    paired: int  # of them, that another episode comes near
    episode: NDArray[np.int_]  # (P, 2) of both frames of a pair, counted from 0
    share: Vector  # (P,) of the first one's episode that has passed
    soon: NDArray[np.bool_]  # (P,) the other is at the same time of its episode
    angle: Vector  # (P,) [rad] of self-motion between the two
    distance: Vector  # (P,) [m] that this moves the arm, where it moves most
    room_share: Vector  # (K,) of an episode that has passed, where self-motion was walked along
    room: Array  # (K, n-6) [rad] how far it can go, all joints together

    @property
    def covered(self) -> float:
        """Share of the frames to which another episode has one at the same pose."""
        return self.paired / self.frames

    def deviation(self, timed: bool) -> tuple[float, float] | None:
        """Standard deviation [rad], [m] of the elbow, given the pose (``timed``: and the time); None without pairs."""
        rows = self.soon if timed else np.ones(len(self.angle), dtype=bool)
        return (_deviation(self.angle[rows]), _deviation(self.distance[rows])) if rows.any() else None

    @property
    def room_deviation(self) -> float:
        """Standard deviation [rad] of elbows that are anywhere within their room."""
        return float(np.sqrt((self.room**2 / 12.0).sum(axis=1).mean()))

    def of_episode(self, episode: int) -> float | None:
        """Median distance [m] of an episode's elbow from that of others at the same pose; None without pairs."""
        rows = (self.episode == episode).any(axis=1)
        return float(np.median(self.distance[rows])) if rows.any() else None


def _deviation(differences: Vector) -> float:
    """Standard deviation of values from the differences of pairs of them, whose variance is twice as large."""
    return float(np.sqrt((differences**2).mean() / 2.0))


def elbow_spread(arm: Arm, paths: Sequence[Array]) -> ElbowSpread:
    """Compare the elbows of episodes, each (T, n) [rad] in time order."""
    kinematics = kinematics_of(arm)
    poses = [kinematics.fk_batch(path) for path in paths]
    states = [np.concatenate([T[:, :3, 3], LENGTH / np.sqrt(2.0) * T[:, :3, :3].reshape(-1, 9)], axis=1) for T in poses]
    trees = [KDTree(each) for each in states]
    episodes = np.repeat(np.arange(len(paths)), [len(path) for path in paths])
    shares = np.concatenate([np.linspace(0.0, 1.0, len(path)) for path in paths]).astype(np.float64)
    starts: list[int] = np.cumsum([0, *map(len, paths)]).tolist()
    q, every = np.concatenate(paths), np.concatenate(states)
    chosen = np.unique(np.linspace(0, len(q) - 1, FRAMES).astype(int))
    first, second = [], []
    for other, tree in enumerate(trees):
        rows = chosen[episodes[chosen] != other]
        distance, nearest = tree.query(every[rows])
        first.append(rows[distance <= NEAR])
        second.append(starts[other] + np.asarray(nearest)[distance <= NEAR])
    one, two = np.concatenate(first), np.concatenate(second)
    N = self_motions(arm, q[one])
    along = np.einsum("pmn,pn->pm", N, q[two] - q[one])
    angle = np.linalg.norm(along, axis=1)
    direction = np.einsum("pm,pmn->pn", along, N) / np.maximum(angle, 1e-12)[:, None]
    speed = np.linalg.norm(arm_points(arm, q[one] + STEP * direction) - arm_points(arm, q[one]), axis=2) / STEP
    walked = [
        starts[i % len(paths)] + round(share * (len(paths[i % len(paths)]) - 1))
        for i, share in enumerate(np.linspace(0.0, 1.0, MEASURED).tolist())
    ]
    return ElbowSpread(
        frames=len(chosen),
        paired=len(np.unique(one)),
        episode=np.stack([episodes[one], episodes[two]], axis=1),
        share=shares[one],
        soon=np.abs(shares[one] - shares[two]) <= SOON,
        angle=angle,
        distance=angle * speed.max(axis=1),
        room_share=shares[walked],
        room=np.array([extents(kinematics, each) for each in q[walked]]),
    )
