"""Reach & Remove Cup: into the cabinet, and out of it again with the cup (paper V-B)."""

from sim_tasks.tasks.reach_cup import ReachCup
from sim_tasks.tasks.remove_cup import RemoveCup


class ReachRemoveCup(RemoveCup):
    """Both in one: the elbow comes up on the way in, and swings out again on the way out."""

    task = "reach_remove_cup"
    task_description = "Reach into the cabinet, grasp the cup by its stem and take it out, upright."
    arms = ("panda",)
    start = ReachCup.start

    def _collision(self) -> str:
        return "collision_removing" if self._was_freed else "collision_reaching"
