"""Reach Cup: from above a deep cabinet, take the cup that stands inside by its stem (paper V-B)."""

from sim_tasks.tasks.cabinet_cup import CabinetCup


class ReachCup(CabinetCup):
    """Take the cup in the cabinet's depth; the elbow decides whether the arm fits."""

    task = "reach_cup"
    task_description = "Reach into the cabinet, grasp the cup by its stem and lift it."
    start = (1.25, -1.01, -0.32, -1.86, -1.18, 1.85, 1.44)  # above and in front of the cabinet
