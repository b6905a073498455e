"""Reach Cup: from above a deep cabinet, take the cup that stands inside by its stem (paper V-B)."""

from sim_tasks.tasks.cabinet_cup import CabinetCup


class ReachCup(CabinetCup):
    """Take the cup in the cabinet's depth; the elbow decides whether the arm fits."""

    task = "reach_cup"
    task_description = "Reach into the cabinet, grasp the cup by its stem and lift it."
    max_steps = 240
    start = (1.25, -1.01, -0.32, -1.86, -1.18, 1.85, 1.44)  # above and in front of the cabinet
    way = (
        ((-0.34, 0.0, 0.04), 1.2),  # down before the opening, the elbow out, clear of the wall
        ((-0.24, 0.0, 0.02), 1.15),
        ((-0.10, 0.0, 0.01), 0.1),  # the elbow comes up while the forearm is still outside
        ((0.003, 0.0, 0.0), 0.1),  # the stem in the middle of the finger pads
    )
    way_back = (((-0.03, 0.0, 0.025), 0.1),)  # lifted
