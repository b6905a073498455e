"""Push Button Elbow: press a button beside the robot with the elbow, the hand free for other work (paper V-B).

The button stands where the elbow comes down when the arm swings it out to the side and lower. The hand
moves by centimetres meanwhile, as it would while it does something else: its pose says nothing of the
elbow, so task space cannot press.
"""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from er_il.kinematics.solver import Status, kinematics_of
from er_il.support.errors import PlanError
from sim_tasks.leader.motion import Keyframe, Stretch, joint_angles, plan_stretch
from sim_tasks.tasks.arm_task import ArmTask, Placement
from sim_tasks.world.contact import touching
from sim_tasks.world.props import PushButton
from sim_tasks.world.randomisation import SLOWEST, interval, sides, span

BUTTON, PEDESTAL = "button", "pedestal"
ELBOW = ("panda_link2", "panda_link3", "panda_link4", "panda_link5")  # upper arm to forearm: no other link may press
PRESSED = 0.02  # [m] of travel from which the button counts as pressed
DEPTH = 0.05  # [m] to which the leader presses: a policy that stops a little short of that has pressed, too
HOLD = 0.5  # [s] for which it does
PITCH = np.radians(57)  # of the hand below the horizontal
FOLLOW = 0.5  # how far the hand goes along with the button's place, so that the elbow comes down on its middle
ASIDE = np.array([-0.04, 0.05, 0.03])  # [m] from there, where the hand is while the elbow swings out
RAISED, LOW, TURN = 0.9, 2.6, 0.005  # [rad] base joint with the elbow out above any button, below all, steps between


class PushButtonElbow(ArmTask):
    """Swing the elbow out and down onto the button."""

    task = "push_button_elbow"
    task_description = "Push the button down with the elbow."
    max_steps = 130
    button = PushButton()
    objects = (BUTTON,)
    obstacles = (PEDESTAL,)
    arms = ("panda", "panda8")
    centre = (0.18, -0.25)
    hand = (0.50, 0.0, 0.60)  # x, y, z [m] of the hand while the elbow presses a button at the centre
    start = (0.25, -0.8, -0.25, -2.1, -0.2, 2.1, 0.9)  # the elbow up
    lean = 0.1  # [rad] of the joints below the base joint, on an arm that has any

    def __init__(
        self,
        *,
        button_range: tuple[float, float] = (0.10, 0.01),
        via_range: float = 0.01,
        speed_range: tuple[float, float] = (0.45, 0.55),
        **kwargs: Any,
    ) -> None:
        """Build the task.

        Args:
            button_range: Sides [m] of the rectangle in which the button stands.
            via_range: The leader's hand is up to this far [m] from the nominal place as the elbow swings out.
            speed_range: The leader's share of the joints' velocity limits.
            kwargs: See :class:`ArmTask`.
        """
        self._button_range = sides("button_range", button_range)
        self._via_range = span("via_range", via_range)
        self._speed_range = interval("speed_range", speed_range, least=SLOWEST)
        super().__init__(**kwargs)
        self._cap = {self._model.body(BUTTON).id}
        self._elbow = {self._model.body(name).id for name in ELBOW}
        self._others = self._robot.bodies - self._elbow
        self._pedestal = int(self._model.body(PEDESTAL).mocapid[0])

    @property
    def travel(self) -> float:
        """How far the button is pressed down [m]."""
        return -float(self._data.joint(BUTTON).qpos[0])

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.button.raised(self.lift).add(spec, BUTTON, PEDESTAL, "red", base="yellow")

    def _draw(self, rng: np.random.Generator) -> Placement:
        x, y = np.array(self.centre) + (rng.random(2) - 0.5) * self._button_range
        return {BUTTON: (x, y, 0.0)}

    def _place(self, placement: Placement) -> None:
        x, y, yaw = placement[BUTTON]
        self._data.mocap_pos[self._pedestal] = (x, y, 0.0)
        self._data.mocap_quat[self._pedestal] = (np.cos(yaw / 2), 0, 0, np.sin(yaw / 2))

    def _succeeds(self) -> bool:
        return self.travel > PRESSED and touching(self._model, self._data, self._elbow, self._cap)

    def _fails(self) -> str:
        return "wrong_link" if touching(self._model, self._data, self._others, self._cap) else ""

    def _times_out(self) -> str:
        return "not_pressed"

    def _script(self, rng: np.random.Generator) -> tuple[Sequence[Stretch], float]:
        x, y = self.object_pose(BUTTON)[:2]
        place = np.array(self.hand) + FOLLOW * np.array([x - self.centre[0], y - self.centre[1], 0.0])
        place[2] += self.lift
        turn = rng.uniform(-self._via_range, self._via_range, 3)
        swing = Keyframe(self._hand_pose(place + ASIDE + turn), RAISED, lean=self.lean)
        pressing = self._hand_pose(place)
        press = Keyframe(pressing, self._pressing_elbow(pressing), straight=True, lean=self.lean)
        # The elbow is to touch the button, and nothing else is near.
        path = plan_stretch(self.arm, self.joint_positions, [swing, press], is_free=lambda _: True)
        return [Stretch(path, gripper=0.0, hold=HOLD)], rng.uniform(*self._speed_range)

    def _hand_pose(self, position: np.ndarray) -> np.ndarray:
        """T_base_ee (4, 4) of a hand that points forward and down."""
        T = np.eye(4)
        T[:3, :3] = Rotation.from_euler("xy", [np.pi, PITCH - np.pi / 2]).as_matrix()
        T[:3, 3] = position
        return T

    def _pressing_elbow(self, T_base_ee: np.ndarray) -> float:
        """Angle of the base joint [rad] at which the elbow has the button down by DEPTH.

        Raises:
            er_il.support.errors.PlanError: the elbow does not get there.
        """
        data = mujoco.MjData(self._model)
        data.mocap_pos[:], data.mocap_quat[:] = self._data.mocap_pos, self._data.mocap_quat
        q = self._nominal_start
        *below, elbow = self.arm.redundant
        leaning = dict.fromkeys(below, self.lean)
        for angle in np.arange(RAISED, LOW, TURN).tolist():
            ik = kinematics_of(self.arm).solve(T_base_ee, q, *joint_angles(self.arm, leaning | {elbow: angle}))
            if ik.status is not Status.OK:
                break
            q = ik.q
            self._robot.place(data, q, 0.0)
            data.joint(BUTTON).qpos = -DEPTH
            mujoco.mj_fwdPosition(self._model, data)
            if touching(self._model, data, self._elbow, self._cap):
                return angle
        x, y = self.object_pose(BUTTON)[:2]
        raise PlanError(f"The elbow does not get down to the button at ({x:.2f}, {y:.2f}).")
