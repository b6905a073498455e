"""The base of tasks in which one object is to be grasped and lifted."""

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.arm_task import ArmTask
from sim_tasks.tasks.placement import Placement, yawed
from sim_tasks.tasks.rewards import Reward, proximity
from sim_tasks.world.contact import collision_geoms, distance, touching

FREED = 0.01  # [m] above its support from which an object that is held counts as taken
GRIPPED = 0.002  # [m] between a finger and an object that it holds; their contact is not at every instant closed
REACH_WIDTH = 0.3  # [m] of the reward's kernel over the distance to the grasp


class PickTask(ArmTask):
    """Reach an object, grasp it with both fingers and lift it."""

    target: ClassVar[str]  # the object to pick
    grasp_height: ClassVar[float]  # [m] of the grasp above the target's origin, along its own z axis
    lift_height: ClassVar[float] = FREED  # [m] above its support to which the target is to be lifted
    closed: ClassVar[float]  # opening below which the gripper counts as closed
    reward = Reward(reach=0.4, grasp=0.2, lift=0.2, success=0.2)

    def __init__(self, **kwargs: Any) -> None:
        """Build the task; for the arguments see :class:`ArmTask`."""
        super().__init__(**kwargs)
        self._target_body = {self.model.body(self.target).id}
        self._target_geoms = collision_geoms(self.model, self._target_body)
        self._finger_geoms = [collision_geoms(self.model, finger) for finger in self._fingers]
        self._was_freed = False  # in this episode

    @property
    @abstractmethod
    def support(self) -> float:
        """Height z [m] of the surface on which the objects stand before this arm."""

    @property
    def touched(self) -> tuple[str, ...]:
        return (self.target,)

    @property
    def grasp_point(self) -> Vector:
        """The point of the target at which it is to be grasped, in the base frame (3,) [m]."""
        body = self.data.body(self.target)
        return body.xpos + self.grasp_height * body.xmat.reshape(3, 3)[:, 2]

    def _place(self, placement: Placement) -> None:
        for name, (x, y, yaw) in placement.items():
            self.data.joint(name).qpos = (x, y, self.support, *yawed(yaw))
        self._was_freed = False

    def _fingers_on_target(self) -> int:
        return sum(touching(self.model, self.data, finger, self._target_body) for finger in self._fingers)

    @property
    def grasped(self) -> bool:
        return self._held()

    def _held(self) -> bool:
        return self._fingers_on_target() == len(self._fingers)

    def _height(self) -> float:
        """Height [m] of the target's origin above the support."""
        return float(self.data.body(self.target).xpos[2]) - self.support

    def _lifted(self) -> bool:
        return self._height() > self.lift_height

    def _succeeds(self) -> bool:
        return self._held() and self._lifted()

    def _fails(self) -> str:
        self._was_freed |= self._held() and self._height() > FREED
        return self._object_failure()

    @abstractmethod
    def _object_failure(self) -> str:
        """Name of an object's irreversible failure, empty if there is none."""

    def _times_out(self) -> str:
        return "missed_grasp" if self.gripper_opening < self.closed and not self._held() else "timeout"

    def _distance_to_grasp(self, hand: Vector) -> float:
        """Length [m] of the shortest path from the hand, at (3,) [m], to the grasp."""
        return float(np.linalg.norm(hand - self.grasp_point))

    def _progress(self) -> dict[str, float]:
        grasp = self._grasp_progress()
        reach = proximity(self._distance_to_grasp(self.ee_pose[:3, 3]), REACH_WIDTH) if grasp < 1 else 1.0
        lift = self._height() / self.lift_height if grasp == 1 else 0.0
        return {"reach": reach, "grasp": grasp, "lift": lift}

    def _grasp_progress(self) -> float:
        """Share of the fingers that are closed on the target."""
        gaps = [distance(self.model, self.data, finger, self._target_geoms) for finger in self._finger_geoms]
        return sum(gap < GRIPPED for gap in gaps) / len(gaps)
