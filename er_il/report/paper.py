"""What the paper measured on a real arm (its table of imitation learning), ten rollouts a figure."""

ARM = "panda"
ROLLOUTS = 10

# Task -> decoder -> successes of ten. The paper has one decoder of task space, MoveIt with pick_ik.
SUCCESSES = {
    "reach_cup": {"joint": 10, "task-nearest": 0, "erj": 10},
    "remove_cup": {"joint": 9, "task-nearest": 4, "erj": 8},
    "reach_remove_cup": {"joint": 9, "task-nearest": 0, "erj": 9},
    "retrieve_bear": {"joint": 10, "task-nearest": 0, "erj": 10},
    "push_button_elbow": {"joint": 10, "task-nearest": 0, "erj": 10},
}


def share(task: str, decoder: str) -> float | None:
    """The paper's success rate of what a decoder stands for; None where the paper has none."""
    successes = SUCCESSES.get(task, {}).get(decoder)
    return None if successes is None else successes / ROLLOUTS
