"""Joint angles and a gripper as LeRobot's robots name and measure them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from er_il.arms.arm import Vector
from er_il.spaces.motors import Motors
from er_il.support.errors import ErIlError

POSITION = ".pos"  # lerobot-rollout passes on nothing but positions (.pos) and velocities (.vel)
GRIPPER = "gripper"


class JointNames:
    """Maps joint angles (n,) [rad] and a gripper's opening, if there is one, to ``{"<joint>.pos": ...}`` and back."""

    def __init__(self, joints: Sequence[str], units: str, gripper: bool = True) -> None:
        """Map ``joints``, spoken of in ``units``; the gripper's opening stays in [0, 1].

        Raises:
            UnknownNameError: the units are neither ``deg`` nor ``rad``.
        """
        self._motors = Motors(tuple(f"{joint}{POSITION}" for joint in joints), units)
        self.names = (*self._motors.joints, *([f"{GRIPPER}{POSITION}"] if gripper else []))

    def to_robot(self, values: Vector) -> dict[str, float]:
        """Name angles (n,) [rad] and the opening, one vector, in the robot's units."""
        n = len(self._motors.joints)
        spoken = [*self._motors.values(values[:n]).tolist(), *values[n:].tolist()]
        return dict(zip(self.names, spoken, strict=True))

    def from_robot(self, named: Mapping[str, Any]) -> Vector:
        """Return angles (n,) [rad] and the opening as one vector. Other names are ignored.

        Raises:
            ErIlError: a joint is missing.
        """
        # Datasets of joint actions call the gripper's opening ``gripper``.
        values = {key.removesuffix(POSITION): value for key, value in named.items()}
        wanted = [name.removesuffix(POSITION) for name in self.names]
        if missing := [name for name in wanted if name not in values]:
            raise ErIlError(
                f"The action lacks {', '.join(missing)}; it has {', '.join(named)}. The robot takes "
                f"{', '.join(self.names)}; an ERJ, ERA or task action must be decoded before: by "
                "--robot.type=er_il_arm around this robot, or er-il attach."
            )
        spoken = np.array([float(values[name]) for name in wanted])
        n = len(self._motors.joints)
        return np.append(self._motors.angles(spoken[:n]), spoken[n:])
