"""Bimanual Press: start a press by its two-hand control, which asks for both buttons at once.

The operator's arms start between two tables, drawn back, the elbows out above them: let down, they sink onto the
tables. Before the buttons stand the press's two guards, between which the forearms fit only with the elbows down: held
out, they strike them. So both elbows must come down once the hands are forward, and the hands' poses say nothing of
that. No constant posture of the elbows does both.
"""

from typing import Any

import mujoco
import numpy as np

from sim_tasks.tasks.bimanual_task import BimanualTask
from sim_tasks.tasks.placement import Area, Placement, yawed
from sim_tasks.tasks.rewards import Reward, proximity
from sim_tasks.world.camera import SHOWCASE, View
from sim_tasks.world.contact import touching
from sim_tasks.world.openarm import fingertips
from sim_tasks.world.press import SIDES, Press
from sim_tasks.world.props import PushButton
from sim_tasks.world.randomisation import sides

HEIGHT = -0.06  # z [m] of the buttons
PRESSED = 0.02  # [m] of travel from which a button counts as pressed
APPROACH_WIDTH = 0.1  # [m] of the reward's kernel over the distance between hand and button
FACING = (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0)  # quaternion (w, x, y, z) of a button that faces -x


class BimanualPress(BimanualTask):
    """Bring both elbows down between the guards and press two buttons at once."""

    task = "bimanual_press"
    task_description = "Start the press: push both buttons at the same time."
    press = Press()
    button = PushButton(radius=0.045)
    objects = ("left_button", "right_button")
    obstacles = press.parts
    centre = (0.50, 0.14)  # x, y [m] of the left button's mean place; the right one's is mirrored
    area = Area((0.46, 0.54), (-0.22, 0.22))
    start = (-0.349, -0.956, 0.993, 2.266, -0.783, 0.003, 1.107)  # drawn back, the elbow out
    reward = Reward(approach=0.5, press=0.25, success=0.25)
    views = (
        View("left_wrist", "openarm_left_link7", (0.06, 0.0, -0.03), (0.0, 0.0, -0.2), 70, up=(1.0, 0.0, 0.0)),
        View("right_wrist", "openarm_right_link7", (0.06, 0.0, -0.03), (0.0, 0.0, -0.2), 70, up=(1.0, 0.0, 0.0)),
        View("head", "world", (0.05, 0.0, 0.32), (0.45, 0.0, -0.1), 75),
        View(SHOWCASE, "world", (-0.72, -0.98, 0.72), (0.24, 0.02, -0.03), 36),
    )

    def __init__(self, *, button_range: tuple[float, float] = (0.03, 0.04), **kwargs: Any) -> None:
        """Build the task.

        Args:
            button_range: Sides [m] of the rectangle in which each button is, its depth and its place from side to side.
            kwargs: See :class:`sim_tasks.tasks.robot_task.RobotTask`.
        """
        self._button_range = sides("button_range", button_range)
        super().__init__(**kwargs)
        self._hands = {side: model.bodies for side, model in zip(SIDES, self.models, strict=True)}
        self._tips = {side: [self.model.body(name).id for name in fingertips(side)] for side in SIDES}
        self._caps = {side: {self.model.body(f"{side}_button").id} for side in SIDES}

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.press.add(spec)
        for side in SIDES:
            self.button.add(spec, f"{side}_button", f"{side}_pedestal", "red", base="yellow")

    def _draw(self, rng: np.random.Generator) -> Placement:
        placement: Placement = {}
        for side, sign in SIDES.items():
            x, y = np.array([self.centre[0], sign * self.centre[1]]) + (rng.random(2) - 0.5) * self._button_range
            placement[f"{side}_button"] = (float(x), float(y), 0.0)
        return placement

    def _place(self, placement: Placement) -> None:
        for side in SIDES:
            x, y, yaw = placement[f"{side}_button"]
            mocap = int(self.model.body(f"{side}_pedestal").mocapid[0])
            self.data.mocap_pos[mocap] = (x + self.button.rest + self.button.dome, y, HEIGHT)
            turned = np.zeros(4)
            mujoco.mju_mulQuat(turned, np.array(yawed(yaw)), np.array(FACING))
            self.data.mocap_quat[mocap] = turned

    def travel(self, side: str) -> float:
        """Distance [m] by which a button is pressed in."""
        return -float(self.data.joint(f"{side}_button").qpos[0])

    def _pressing(self, side: str) -> bool:
        return touching(self.model, self.data, self._hands[side], self._caps[side])

    def _succeeds(self) -> bool:
        return all(self.travel(side) > PRESSED and self._pressing(side) for side in SIDES)

    def _fails(self) -> str:
        return ""

    def _times_out(self) -> str:
        pressed = [self.travel(side) > PRESSED for side in SIDES]
        return "one_button" if any(pressed) else "not_pressed"

    def _progress(self) -> dict[str, float]:
        """The mean of both hands."""
        approach = press = 0.0
        for side in SIDES:
            if self._pressing(side):
                approach, press = approach + 0.5, press + 0.5 * min(self.travel(side) / PRESSED, 1.0)
            else:
                tip = self.data.xpos[self._tips[side]].mean(axis=0)
                gap = float(np.linalg.norm(tip - self.data.body(f"{side}_button").xpos))
                approach += 0.5 * proximity(gap, APPROACH_WIDTH)
        return {"approach": approach, "press": press}
