"""MuJoCo tasks for a redundant arm, as Gymnasium environments ``sim_tasks/<Task>-v0``.

Importing the package registers them, and loads neither MuJoCo nor the kinematics.
"""

from sim_tasks.registry import TaskEntry, register

RL_STEPS = 400  # control steps of an episode: the paper's 200 decisions at 10 Hz
_TASKS, _SCRIPTS = "sim_tasks.tasks", "sim_tasks.leader.scripts"

TASKS = (
    TaskEntry("reach_cup", f"{_TASKS}.reach_cup:ReachCup", 240, f"{_SCRIPTS}.cup:ReachCupLeader"),
    TaskEntry("remove_cup", f"{_TASKS}.remove_cup:RemoveCup", 215, f"{_SCRIPTS}.cup:RemoveCupLeader"),
    TaskEntry(
        "reach_remove_cup", f"{_TASKS}.reach_remove_cup:ReachRemoveCup", 300, f"{_SCRIPTS}.cup:ReachRemoveCupLeader"
    ),
    TaskEntry("lift_cup", f"{_TASKS}.lift_cup:LiftCup", 200, f"{_SCRIPTS}.cup:LiftCupLeader"),
    TaskEntry(
        "push_button_elbow", f"{_TASKS}.push_button_elbow:PushButtonElbow", 130, f"{_SCRIPTS}.button:PushButtonLeader"
    ),
    TaskEntry("retrieve_bear", f"{_TASKS}.retrieve_bear:RetrieveBear", 200, f"{_SCRIPTS}.bear:RetrieveBearLeader"),
)

# The paper's reinforcement-learning tasks (section V-A), each with a module of the task and one of its leader.
FULL_BODY = (
    "reach_elbow_pose",
    "take_bottle_out_fridge",
    "slide_cup_obstacles",
    "serve_coffee_obstacles",
    "meat_off_grill",
    "take_cup_out_cabinet",
)
STANDARD = (
    "reach_target",
    "pick_up_cup",
    "take_umbrella_out_of_stand",
    "take_lid_off_saucepan",
    "pick_and_lift",
    "stack_wine",
    "phone_on_base",
    "put_rubbish_in_bin",
)


def _rl_entry(task: str) -> TaskEntry:
    name = "".join(word.capitalize() for word in task.split("_"))
    return TaskEntry(task, f"{_TASKS}.{task}:{name}", RL_STEPS, f"{_SCRIPTS}.{task}:{name}Leader")


RL_TASKS = tuple(map(_rl_entry, (*FULL_BODY, *STANDARD)))

# For a robot with two arms.
BIMANUAL_TASKS = (
    TaskEntry(
        "bimanual_press",
        f"{_TASKS}.bimanual_press:BimanualPress",
        120,
        f"{_SCRIPTS}.bimanual_press:BimanualPressLeader",
    ),
)

for _entry in (*TASKS, *RL_TASKS, *BIMANUAL_TASKS):
    register(_entry)
