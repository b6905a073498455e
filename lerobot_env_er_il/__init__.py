"""LeRobot finds plugins by distribution name; importing this module registers er_il's, and checks the command.

Mistakes that er_il finds end LeRobot's commands with one line, too.
"""

import sys

import er_il.envs.lerobot_plugin  # --env.type=er_il
import er_il.rl.configuration_agent  # --policy.path=AGENT
import er_il.rl.lerobot_env  # --env.type=er_il_rl
import er_il.robots.hardware  # --robot.type=er_il_arm, er_il_sim; --teleop.type=er_il_scripted_leader
import er_il.robots.processors  # noqa: F401  the decoding steps of policies and pipelines
from er_il.policy import chunk_pipelines
from er_il.robots.guard import check_command
from er_il.support.uncaught import tell_uncaught_in_one_line

tell_uncaught_in_one_line()
chunk_pipelines.install()  # lerobot-train on chunk-relative datasets
check_command(sys.argv[1:])
