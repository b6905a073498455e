"""MuJoCo tasks for a redundant arm, as Gymnasium environments ``sim_tasks/<Task>-v0``.

Importing the package registers them, and loads neither MuJoCo nor the kinematics.
"""

from sim_tasks.registry import TaskEntry, register

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

for _entry in TASKS:
    register(_entry)
