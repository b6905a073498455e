"""The script of Push Button Elbow."""

from collections.abc import Sequence

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from er_il.kinematics.solver import Status, kinematics_of
from er_il.support.errors import PlanError
from sim_tasks.leader.leader import Leader
from sim_tasks.leader.motion import Keyframe, Segment, joint_angles, plan_path
from sim_tasks.tasks.push_button_elbow import BUTTON, PushButtonElbow
from sim_tasks.world.contact import touching

HAND = (0.50, 0.0, 0.60)  # x, y, z [m] of the hand while the elbow presses a button at the centre
PITCH = np.radians(57)  # of the hand below the horizontal
FOLLOW = 0.5  # share of the button's displacement by which the hand moves, so that the elbow meets its middle
ASIDE = np.array([-0.04, 0.05, 0.03])  # [m] from there, the hand's via point while the elbow swings out
RAISED, LOW, TURN = 0.9, 2.6, 0.005  # [rad] base joint with the elbow out above any button, below all, search step
DEPTH = 0.05  # [m] to which the leader presses: a policy that stops a little short of that has pressed, too
HOLD = 0.5  # [s] for which it does
LEAN = 0.1  # [rad] of the joints below the base joint, on an arm with any


class PushButtonLeader(Leader[PushButtonElbow]):
    """Swings the elbow out above the button, then lowers it."""

    def _script(self, rng: np.random.Generator) -> tuple[Sequence[Segment], float]:
        world = self._world
        x, y = world.object_pose(BUTTON)[:2]
        hand = np.array(HAND) + FOLLOW * np.array([x - world.centre[0], y - world.centre[1], 0.0])
        hand[2] += world.shoulder_offset
        swing = Keyframe(_hand_pose(hand + ASIDE + self._draw_via(rng)), RAISED, lean=LEAN)
        pressing = _hand_pose(hand)
        press = Keyframe(pressing, self._pressing_elbow(pressing), straight=True, lean=LEAN)
        # The elbow is to touch the button, and nothing else is near.
        path = plan_path(world.arm, world.joint_positions, [swing, press], is_free=lambda _: True)
        return [Segment(path, gripper=0.0, hold=HOLD)], self._draw_speed(rng)

    def _pressing_elbow(self, T_base_ee: np.ndarray) -> float:
        """Angle of the base joint [rad] at which the elbow has the button down by DEPTH.

        Raises:
            PlanError: the elbow does not get there.
        """
        world = self._world
        data = mujoco.MjData(world.model)
        data.mocap_pos[:], data.mocap_quat[:] = world.data.mocap_pos, world.data.mocap_quat
        q = world.nominal_start
        *below, elbow = world.arm.redundant
        leaning = dict.fromkeys(below, LEAN)
        for angle in np.arange(RAISED, LOW, TURN).tolist():
            ik = kinematics_of(world.arm).solve(T_base_ee, q, *joint_angles(world.arm, leaning | {elbow: angle}))
            if ik.status is not Status.OK:
                break
            q = ik.q
            world.robot.place(data, q, 0.0)
            data.joint(BUTTON).qpos = -DEPTH
            mujoco.mj_fwdPosition(world.model, data)
            if touching(world.model, data, world.elbow, world.cap):
                return angle
        x, y = world.object_pose(BUTTON)[:2]
        raise PlanError(f"The elbow does not get down to the button at ({x:.2f}, {y:.2f}).")


def _hand_pose(position: np.ndarray) -> np.ndarray:
    """T_base_ee (4, 4) of a hand at ``position`` (3,) [m] that points forward and down.

    The pose is that of :func:`sim_tasks.leader.hand.hand_pose` but for the last bits, on which the published
    demonstrations depend.
    """
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xy", [np.pi, PITCH - np.pi / 2]).as_matrix()
    T[:3, 3] = position
    return T
