"""Push Button Elbow: press a button beside the robot with the elbow, the hand free for other work (paper V-B).

The button stands where the elbow comes down when the arm swings it out to the side and lower. The hand
moves by centimetres meanwhile, as it would while it does something else: its pose says nothing of the
elbow, so task space cannot press.
"""

from typing import Any

import mujoco
import numpy as np

from sim_tasks.tasks.arm_task import ArmTask
from sim_tasks.tasks.placement import Placement, yawed
from sim_tasks.tasks.rewards import Reward, proximity
from sim_tasks.world.contact import collision_geoms, distance, touching
from sim_tasks.world.props import PushButton
from sim_tasks.world.randomisation import sides

BUTTON, PEDESTAL = "button", "pedestal"
ELBOW = ("panda_link2", "panda_link3", "panda_link4", "panda_link5")  # upper arm to forearm: no other link may press
PRESSED = 0.02  # [m] of travel from which the button counts as pressed
APPROACH_WIDTH = 0.1  # [m] of the reward's kernel over the distance between elbow and cap


class PushButtonElbow(ArmTask):
    """Swing the elbow out and down onto the button."""

    task = "push_button_elbow"
    task_description = "Push the button down with the elbow."
    button = PushButton()
    objects = (BUTTON,)
    obstacles = (PEDESTAL,)
    arms = ("panda", "panda8")
    centre = (0.18, -0.25)  # x, y [m] of the button's mean place
    start = (0.25, -0.8, -0.25, -2.1, -0.2, 2.1, 0.9)  # the elbow up
    reward = Reward(approach=0.5, press=0.25, success=0.25)

    def __init__(self, *, button_range: tuple[float, float] = (0.10, 0.01), **kwargs: Any) -> None:
        """Build the task.

        Args:
            button_range: Sides [m] of the rectangle in which the button stands.
            kwargs: See :class:`ArmTask`.
        """
        self._button_range = sides("button_range", button_range)
        super().__init__(**kwargs)
        self.cap = {self.model.body(BUTTON).id}  # ids of bodies
        self.elbow = {self.model.body(name).id for name in ELBOW}
        self._others = self.robot.bodies - self.elbow
        self._cap_geoms = collision_geoms(self.model, self.cap)
        self._elbow_geoms = collision_geoms(self.model, self.elbow)
        self._pedestal = int(self.model.body(PEDESTAL).mocapid[0])

    @property
    def touched(self) -> tuple[str, ...]:
        return (BUTTON,)

    @property
    def travel(self) -> float:
        """Distance [m] by which the button is pressed down."""
        return -float(self.data.joint(BUTTON).qpos[0])

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.button.raised(self.shoulder_offset).add(spec, BUTTON, PEDESTAL, "red", base="yellow")

    def _draw(self, rng: np.random.Generator) -> Placement:
        x, y = np.array(self.centre) + (rng.random(2) - 0.5) * self._button_range
        return {BUTTON: (x, y, 0.0)}

    def _place(self, placement: Placement) -> None:
        x, y, yaw = placement[BUTTON]
        self.data.mocap_pos[self._pedestal] = (x, y, 0.0)
        self.data.mocap_quat[self._pedestal] = yawed(yaw)

    def _pressing(self) -> bool:
        return touching(self.model, self.data, self.elbow, self.cap)

    def _succeeds(self) -> bool:
        return self.travel > PRESSED and self._pressing()

    def _fails(self) -> str:
        return "wrong_link" if touching(self.model, self.data, self._others, self.cap) else ""

    def _times_out(self) -> str:
        return "not_pressed"

    def _progress(self) -> dict[str, float]:
        if self._pressing():
            return {"approach": 1.0, "press": self.travel / PRESSED}
        gap = distance(self.model, self.data, self._elbow_geoms, self._cap_geoms)
        return {"approach": proximity(gap, APPROACH_WIDTH), "press": 0.0}
