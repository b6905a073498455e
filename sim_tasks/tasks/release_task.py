"""The base of the tasks that end with a thing at its place and nothing in the hand (paper V-A)."""

from abc import abstractmethod

from sim_tasks.tasks.object_task import ObjectTask


class ReleaseTask(ObjectTask):
    """Carry a thing to its place and let go of it."""

    @abstractmethod
    def _in_place(self) -> bool:
        """True if the thing is where it belongs, held or not."""

    def _succeeds(self) -> bool:
        return self._in_place() and not self.grasped
