"""Reach Elbow Pose: bring hand and elbow each to a place of its own (paper V-A).

The hand's pose leaves the elbow a circle; the green ball says where on it the elbow is to be. Goals are drawn as
postures of the arm, so that hand and elbow can always be there at once.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from er_il.arms.arm import Vector
from er_il.kinematics.arm_angle import ElbowCircle
from er_il.kinematics.solver import Status, kinematics_of
from sim_tasks.tasks.object_task import TURN_WIDTH, WIDTH, ObjectTask, add_goal
from sim_tasks.tasks.placement import Placement
from sim_tasks.tasks.rewards import Reward, closeness
from sim_tasks.world.props import BOX
from sim_tasks.world.randomisation import sides, span

HAND_GOAL, ELBOW_GOAL = "hand_goal", "elbow_goal"
SHOULDER, ELBOW, WRIST = "panda_link2", "panda_link4", "panda_link6"  # links of the arm angle
REACHED = 0.075  # [m] from each ball's centre
TURNED = 0.09  # [rad] of the rotation vector's three numbers in the mean, which small Euler angles approach
HEIGHTS = (0.20, 0.50)  # [m] of the hand's goal above the bench
SIDEWAYS = np.pi * np.array([0.30, 0.45])  # [rad] the elbow's turn from the top of its circle, to either side
DOWN = Rotation.from_euler("x", np.pi)  # the hand points down, its fingers beside each other
SIDE = np.array(
    [1.45, -1.1, -1.2, -2.2, -0.9, 1.6, 1.5]
)  # [rad] a posture with the elbow out to the right, the hand down
MIRROR = np.array([-1, 1, -1, 1, -1, 1, -1])  # turns it to the left, the last joint about STRAIGHT
STRAIGHT = np.array([0, 0, 0, 0, 0, 0, np.pi / 4])  # [rad] with which the hand is square to the forearm
SPREAD = 0.4  # [rad] of the postures from which goals are sought
POSTURE_DIGITS = 4  # of a posture's angles [rad]
MARGIN = 0.1  # [rad] between a goal's posture and the joints' limits
RED, GREEN = (0.85, 0.10, 0.10, 1.0), (0.15, 0.65, 0.20, 0.6)


class ReachElbowPose(ObjectTask):
    """The hand at the red ball, turned as the marker there, and the elbow in the green ball."""

    task = "reach_elbow_pose"
    task_description = "Bring the hand to the red ball and the elbow to the green ball."
    objects = (HAND_GOAL, ELBOW_GOAL)
    arms = ("panda", "panda8")
    centre = (0.475, 0.0)  # x, y [m] of the middle of the hand's goals
    start = (0.0, -0.6, 0.0, -2.05, 0.0, 2.2, np.pi / 4)  # the elbow on top, the hand pointing forward and down
    reward = Reward(hand=0.25, turn=0.25, elbow=0.25, success=0.25)

    def __init__(
        self, *, hand_range: tuple[float, float] = (0.25, 0.40), turn_range: float = 0.2618, **kwargs: Any
    ) -> None:
        """Build the task.

        Args:
            hand_range: Sides [m] of the rectangle above which the hand's goal is.
            turn_range: The hand's goal is turned up to this far [rad] about each axis from pointing down.
            kwargs: See :class:`ObjectTask`.
        """
        self._hand_range = sides("hand_range", hand_range)
        self._turn_range = span("turn_range", turn_range)
        self._heights = {HAND_GOAL: 0.0, ELBOW_GOAL: 0.0}  # [m] in this episode
        self._tilt: Sequence[float] = (0.0, 0.0)  # [rad] of the hand's goal in this episode, about x and y
        super().__init__(**kwargs)
        self.posture = self.nominal_start  # (n,) [rad] one that meets both of the goals drawn
        self._elbow = self.model.body(ELBOW).id

    def _build(self, spec: mujoco.MjSpec) -> None:
        marker = add_goal(spec, HAND_GOAL, 0.025, RED)
        # A small hand behind its tip: stem, palm, two fingers.
        for size, y, z in (
            ((0.008, 0.008, 0.035), 0.0, -0.095),
            ((0.012, 0.058, 0.008), 0.0, -0.060),
            ((0.012, 0.008, 0.030), 0.050, -0.030),
            ((0.012, 0.008, 0.030), -0.050, -0.030),
        ):
            marker.add_geom(type=BOX, size=size, pos=(0, y, z), rgba=RED, contype=0, conaffinity=0, group=2)
        add_goal(spec, ELBOW_GOAL, REACHED, GREEN)

    def _draw(self, rng: np.random.Generator) -> Placement:
        while True:
            x, y = np.array(self.centre) + (rng.random(2) - 0.5) * self._hand_range
            height = rng.uniform(*HEIGHTS)
            *tilt, yaw = rng.uniform(-self._turn_range, self._turn_range, 3).tolist()
            T_base_hand = np.eye(4)
            T_base_hand[:3, :3] = _turned(tilt, yaw).as_matrix()
            T_base_hand[:3, 3] = (x, y, height + self.shoulder_offset)
            posture = self._posture(T_base_hand, rng)
            if posture is not None:
                break
        self.posture, self._tilt = posture, tilt
        elbow = kinematics_of(self.arm).frame_pose(posture, ELBOW)[:3, 3]
        self._heights = {HAND_GOAL: height, ELBOW_GOAL: float(elbow[2]) - self.shoulder_offset}
        return {HAND_GOAL: (x, y, yaw), ELBOW_GOAL: (float(elbow[0]), float(elbow[1]), 0.0)}

    def _posture(self, T_base_hand: np.ndarray, rng: np.random.Generator) -> Vector | None:
        """A posture (n,) [rad] with the elbow at a random side; None if the one drawn does not suit."""
        arm, kinematics = self.arm, kinematics_of(self.arm)
        seed = self.nominal_start
        seed[-len(SIDE) :] = STRAIGHT + (SIDE - STRAIGHT) * (MIRROR if rng.random() < 0.5 else 1)
        ik = kinematics.solve(T_base_hand, seed + rng.uniform(-SPREAD, SPREAD, arm.dof))
        q = ik.q.round(POSTURE_DIGITS)  # a free elbow is found a little differently from machine to machine
        if ik.status is not Status.OK or np.any((q < arm.lower + MARGIN) | (q > arm.upper - MARGIN)):
            return None
        points = [tuple(kinematics.frame_pose(q, link)[:3, 3]) for link in (SHOULDER, ELBOW, WRIST)]
        angle = abs(ElbowCircle.through(*points).angle)
        return q if SIDEWAYS[0] <= angle <= SIDEWAYS[1] else None

    def _arrange(self, placement: Placement) -> None:
        (x, y, yaw), (elbow_x, elbow_y, _) = placement[HAND_GOAL], placement[ELBOW_GOAL]
        i, j, k, w = _turned(self._tilt, yaw).as_quat()
        self._put(HAND_GOAL, (x, y, self._heights[HAND_GOAL]), (w, i, j, k))
        self._put(ELBOW_GOAL, (elbow_x, elbow_y, self._heights[ELBOW_GOAL]))

    @property
    def ways(self) -> Mapping[str, Vector]:
        return {
            HAND_GOAL: self.position(HAND_GOAL) - self.tip,
            "turn": self.rotation(HAND_GOAL) @ self._turn_left(),
            ELBOW_GOAL: self.position(ELBOW_GOAL) - self.data.xpos[self._elbow],
        }

    def _hand_distance(self) -> float:
        return float(np.linalg.norm(self.tip - self.position(HAND_GOAL)))

    def _turn_left(self) -> Vector:
        """The rotation vector (3,) [rad] by which the hand is yet to turn, in the goal's frame."""
        return Rotation.from_matrix(self.tip_rotation.T @ self.rotation(HAND_GOAL)).as_rotvec()

    def _turn(self) -> float:
        """Mean [rad] over the three axes of the turn that the hand lacks."""
        return float(np.mean(np.abs(self._turn_left())))

    def _elbow_distance(self) -> float:
        return float(np.linalg.norm(self.data.xpos[self._elbow] - self.position(ELBOW_GOAL)))

    def _succeeds(self) -> bool:
        return self._hand_distance() <= REACHED and self._turn() <= TURNED and self._elbow_distance() <= REACHED

    def _progress(self) -> dict[str, float]:
        errors = {
            "hand": (self._hand_distance(), REACHED, WIDTH),
            "turn": (self._turn(), TURNED, TURN_WIDTH),
            "elbow": (self._elbow_distance(), REACHED, WIDTH),
        }
        return {
            name: 1.0 if error <= enough else closeness(error, width) for name, (error, enough, width) in errors.items()
        }


def _turned(tilt: Sequence[float], yaw: float) -> Rotation:
    """Orientation of a hand that points down but for a tilt [rad] about x and y, then a yaw [rad]."""
    return Rotation.from_euler("xyz", [*tilt, yaw]) * DOWN
