"""The decoders that reports compare: an action space, and a resolution of the freedom that it leaves to IK.

All decoders of task space read the same dataset and the same policy.
"""

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

from er_il.arms.arm import Arm
from er_il.envs.protocol import ClearanceEnv, arm_env, clearance_env
from er_il.spaces.base import ArmSpace
from er_il.spaces.clear import keeping_clear
from er_il.spaces.delta import PREFIX
from er_il.spaces.pose import TASK
from er_il.spaces.registry import AT, SPACES, make_arm_space, split_name
from er_il.support.errors import ErIlError, ShapeError, UnknownNameError

NEAREST, POSTURE, CLEAR = "nearest", "posture", "clear"
RESOLUTIONS = (NEAREST, POSTURE, CLEAR)


@dataclass(frozen=True)
class Decoder:
    """An action space by name, absolute or delta, and how IK resolves what the action leaves open.

    ``nearest`` takes the solution near the measured joints, ``posture`` the one near a posture: the
    arm's comfortable one, or the one given here. ``clear`` slides along the self-motion away from the
    world, whose true distances it needs: in simulation only. Only task space leaves anything open.
    """

    space: str
    resolution: str = NEAREST
    posture: tuple[float, ...] = ()  # (n,) [rad]; the arm's comfortable one if empty

    def __post_init__(self) -> None:
        split_name(self.space)  # raises if unknown
        if self.resolution not in RESOLUTIONS:
            raise UnknownNameError("resolution", self.resolution, RESOLUTIONS)
        if self.resolution == CLEAR and self.space.removeprefix(PREFIX) != TASK:
            raise ErIlError(f"The resolution {CLEAR} is for task space: {self.space} leaves it nothing to resolve.")

    def works_in(self, env: gymnasium.Env[Any, Any]) -> bool:
        """False if an environment does not tell the clearances that ``clear`` needs."""
        return self.resolution != CLEAR or isinstance(env.unwrapped, ClearanceEnv)

    def space_in(self, env: gymnasium.Env[Any, Any], rotation: str = "quat") -> ArmSpace:
        """Build the action space that decodes in an environment.

        Raises:
            ErIlError: it is no arm environment, or does not tell the clearances that ``clear`` needs.
        """
        space = self.space_of(arm_env(env).arm, rotation)
        return keeping_clear(space, clearance_env(env).clearances) if self.resolution == CLEAR else space

    def space_of(self, arm: Arm, rotation: str = "quat") -> ArmSpace:
        """Build the action space for an arm, as far as no world is needed: what actions mean, whatever decodes them."""
        chosen = np.array(self.posture) if self.posture else arm.home
        if chosen.shape != (arm.dof,):
            raise ShapeError("The posture", chosen.shape, f"({arm.dof},)")
        posture = chosen if self.resolution == POSTURE else None
        return make_arm_space(self.space, arm, rotation=rotation, posture=posture)


def _decoders() -> dict[str, Decoder]:
    table = {space: Decoder(space) for space in SPACES if space != TASK}
    table |= {f"task-{resolution}": Decoder(TASK, resolution) for resolution in RESOLUTIONS}
    return table


DECODERS = _decoders()  # by the name that reports use


def decoder(name: str) -> Decoder:
    """Return a decoder by its report name, or that of an action space with its joints: ``erj@panda_joint3``.

    Raises:
        UnknownNameError: no decoder has that name.
    """
    if AT in name:
        return Decoder(name)
    if name not in DECODERS:
        raise UnknownNameError("decoder", name, DECODERS)
    return DECODERS[name]
