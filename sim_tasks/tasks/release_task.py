"""The base of the tasks that end with a thing at its place and nothing in the hand (paper V-A)."""

from abc import abstractmethod

from sim_tasks.tasks.object_task import ObjectTask
from sim_tasks.world.robot import FINGER_TRAVEL


class ReleaseTask(ObjectTask):
    """Carry a thing to its place and let go of it."""

    @property
    def commanded_opening(self) -> float:
        """The opening in [0, 1] that the fingers are told to have, as in the paper's rewards.

        Around a thing the measured one tells its width alone.
        """
        return float(self.data.ctrl[self.robot.gripper]) / FINGER_TRAVEL

    @abstractmethod
    def _in_place(self) -> bool:
        """True if the thing is where it belongs, held or not."""

    def _succeeds(self) -> bool:
        return self._in_place() and not self.grasped
