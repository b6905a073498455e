"""Remove Cup: the arm is inside the cabinet; take the cup by its stem and bring it out upright (paper V-B)."""

from sim_tasks.tasks.cabinet_cup import CabinetCup
from sim_tasks.tasks.rewards import Reward, proximity

REMOVE_WIDTH = 0.2  # [m] of the reward's kernel over the distance that the cup must still move out


class RemoveCup(CabinetCup):
    """Take the cup out of the cabinet; inside the elbow is right, and it must swing out with the hand."""

    task = "remove_cup"
    task_description = "Grasp the cup by its stem and take it out of the cabinet, upright."
    start = (0.1, -0.302, -0.125, -2.244, -0.238, 3.166, 0.981)  # inside, the elbow up, the stem 12 cm ahead
    reward = Reward(reach=0.25, grasp=0.125, lift=0.125, remove=0.25, success=0.25)

    def _succeeds(self) -> bool:
        return super()._succeeds() and self._outside()

    def _times_out(self) -> str:
        return "not_removed" if self._held() or self._was_freed else super()._times_out()

    def _progress(self) -> dict[str, float]:
        progress = super()._progress()
        remove = proximity(self._beyond_front(), REMOVE_WIDTH) if progress["lift"] >= 1 else 0.0
        return progress | {"remove": remove}
