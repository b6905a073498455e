"""LeRobot finds plugins by distribution name; importing this module registers er_il's."""

import er_il.hardware  # --robot.type=er_il_sim --teleop.type=er_il_scripted_leader
import er_il.lerobot_env  # noqa: F401  --env.type=er_il
