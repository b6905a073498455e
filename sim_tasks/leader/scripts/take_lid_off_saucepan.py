"""The script of Take Lid Off Saucepan."""

from sim_tasks.leader.scripts.grasp import CarryLeader
from sim_tasks.tasks.take_lid_off_saucepan import TakeLidOffSaucepan


class TakeLidOffSaucepanLeader(CarryLeader[TakeLidOffSaucepan]):
    """Straight up."""
