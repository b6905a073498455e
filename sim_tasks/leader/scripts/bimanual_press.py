"""The script of Bimanual Press."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from sim_tasks.leader.bimanual import BimanualLeader, HandAndElbow
from sim_tasks.leader.motion import Segment
from sim_tasks.tasks.bimanual_press import HEIGHT, BimanualPress
from sim_tasks.world.press import SIDES

FORWARD = Rotation.from_euler("xy", [np.pi, -np.pi / 2]).as_matrix()  # of a hand that points forward
FINGERTIP = 0.0065  # [m] that the fingers reach beyond the end-effector frame
DOWN = np.radians(184)  # arm angle of a left elbow that hangs
BETWEEN = 0.445  # x [m] of the hands when the elbows are down, before the guards
FORWARD_FIRST, OUT = 0.375, np.radians(236)  # x [m] of the hands that come forward with the elbows out, arm angle there
LOWER = 0.02  # [m] below the buttons, their height there
BEFORE, DEPTH = 0.02, 0.045  # [m] before the buttons, and into them: a policy that stops a little short pressed, too
HOLD = 0.5  # [s] for which it presses


class BimanualPressLeader(BimanualLeader[BimanualPress]):
    """Brings the hands forward, lets both elbows down before the guards, then pushes both buttons."""

    def _script(self, rng: np.random.Generator) -> tuple[Sequence[Segment], float]:
        world, checks = self._world, self._collisions()
        buttons = {side: world.object_pose(f"{side}_button")[:3] for side in SIDES}
        vias = {
            side: np.array([BETWEEN, y, HEIGHT - LOWER]) + self._draw_via(rng) for side, (_, y, _) in buttons.items()
        }
        face = world.button.dome + FINGERTIP
        before, pressed = (
            {side: button - np.array([face + way, 0.0, 0.0]) for side, button in buttons.items()}
            for way in (BEFORE, -DEPTH)
        )
        first = {side: np.array([FORWARD_FIRST, *via[1:]]) for side, via in vias.items()}
        goals = [{side: _hand(side, first[side], OUT) for side in SIDES}]
        goals += [{side: _hand(side, place[side], DOWN) for side in SIDES} for place in (vias, before)]
        approach = self._path(world.joint_positions, goals, checks)
        press = self._path(approach[-1], [{side: _hand(side, pressed[side], DOWN) for side in SIDES}], checks)
        return [Segment(approach, gripper=0.0), Segment(press, gripper=0.0, hold=HOLD, pace=0.4)], self._draw_speed(rng)


def _hand(side: str, position: np.ndarray, angle: float) -> HandAndElbow:
    T_base_ee = np.eye(4)
    T_base_ee[:3, :3], T_base_ee[:3, 3] = FORWARD, position
    return HandAndElbow(T_base_ee, SIDES[side] * angle)
