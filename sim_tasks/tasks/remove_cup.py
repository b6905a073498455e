"""Remove Cup: the arm is inside the cabinet; take the cup by its stem and bring it out upright (paper V-B)."""

from sim_tasks.tasks.cabinet_cup import CabinetCup


class RemoveCup(CabinetCup):
    """Take the cup out of the cabinet; inside the elbow is right, and it must swing out with the hand."""

    task = "remove_cup"
    task_description = "Grasp the cup by its stem and take it out of the cabinet, upright."
    max_steps = 215
    lean = 0.1
    start = (0.1, -0.302, -0.125, -2.244, -0.238, 3.166, 0.981)  # inside, the elbow up, the stem 12 cm ahead
    pace = 0.5  # else the grasp is over in half a second, too few frames to learn it from
    way = (
        ((-0.04, 0.0, 0.012), 0.1),  # no lower: the wrist would touch the floor of the compartment
        ((0.003, 0.0, 0.0), 0.1),  # the stem in the middle of the finger pads
    )
    way_back = (
        ((-0.03, 0.0, 0.025), 0.1),  # lifted
        ((-0.10, 0.0, 0.03), 0.1),
        ((-0.24, 0.0, 0.03), 1.15),  # the elbow swings out before it leans back into the wall
        ((-0.39, 0.0, 0.04), 1.3),  # farther than success asks, so that a policy passes its border
    )

    def _succeeds(self) -> bool:
        return super()._succeeds() and self._outside()

    def _times_out(self) -> str:
        return "not_removed" if self._held() or self._was_freed else super()._times_out()
