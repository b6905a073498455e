"""LeRobot finds plugins by distribution name; importing this module registers er_il's."""
