"""LeRobot finds plugins by distribution name; importing this module registers er_il's, and checks the command."""

import sys

import er_il.envs.lerobot_plugin  # --env.type=er_il
import er_il.robots.hardware  # --robot.type=er_il_arm, er_il_sim; --teleop.type=er_il_scripted_leader
import er_il.robots.processors  # noqa: F401  the decoding steps of policies and pipelines
from er_il.robots.guard import check_command

check_command(sys.argv[1:])
