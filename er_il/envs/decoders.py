"""The decoders that reports compare: an action space, and a resolution of the freedom that it leaves to IK.

All decoders of task space read the same dataset and the same policy.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Any

import gymnasium
import numpy as np

from er_il.arms.arm import Arm
from er_il.envs.protocol import ClearanceEnv, arms_of, clearance_env, robot_env
from er_il.spaces.base import ArmSpace
from er_il.spaces.chunk import RELATIVE, chunk_of, commands_of
from er_il.spaces.clear import keeping_clear
from er_il.spaces.delta import PREFIX
from er_il.spaces.layout import Layout
from er_il.spaces.pose import TASK
from er_il.spaces.registry import AT, SPACES, make_arm_space, split_name
from er_il.support.errors import ErIlError, ShapeError, UnknownNameError

NEAREST, POSTURE, CLEAR = "nearest", "posture", "clear"
RESOLUTIONS = (NEAREST, POSTURE, CLEAR)


@dataclass(frozen=True)
class Decoder:
    """An action space by name, absolute or delta, and how IK resolves what the action leaves open.

    A chunk-relative space decodes as that of its commands: the policy's processors have made them absolute.

    ``nearest`` takes the solution near the measured joints, ``posture`` the one near a posture: the
    arm's comfortable one, or the one given here. ``clear`` slides along the self-motion away from the
    world, whose true distances it needs: in simulation only. Only task space leaves anything open.
    """

    space: str
    resolution: str = NEAREST
    posture: tuple[float, ...] = ()  # (n,) [rad], of several arms one after the other; comfortable ones if empty

    def __post_init__(self) -> None:
        split_name(self.space)  # raises if unknown
        if self.resolution not in RESOLUTIONS:
            raise UnknownNameError("resolution", self.resolution, RESOLUTIONS)
        if self.resolution == CLEAR and commands_of(self.space).removeprefix(PREFIX) != TASK:
            raise ErIlError(f"The resolution {CLEAR} is for task space: {self.space} leaves it nothing to resolve.")

    def works_in(self, env: gymnasium.Env[Any, Any]) -> bool:
        """False if an environment does not tell the clearances that ``clear`` needs."""
        return self.resolution != CLEAR or isinstance(env.unwrapped, ClearanceEnv)

    def layout_in(self, env: gymnasium.Env[Any, Any], rotation: str = "quat") -> Layout:
        """Build the layout of an environment's arms, each with the action space that decodes there.

        Raises:
            ErIlError: it is no environment of arms, or does not tell the clearances that ``clear`` needs.
        """
        if self.resolution != CLEAR:
            return self.layout_of(arms_of(robot_env(env)), rotation)
        world = clearance_env(env)
        space = keeping_clear(self.space_of(world.arm, rotation), world.clearances)
        return Layout.of_spaces({"": space}, chunk_of(self.space))

    def space_of(self, arm: Arm, rotation: str = "quat") -> ArmSpace:
        """Build the action space for an arm, as far as no world is needed: what actions mean, whatever decodes them."""
        return self.layout_of({"": arm}, rotation).parts[0].space

    def layout_of(self, arms: Mapping[str, Arm], rotation: str = "quat") -> Layout:
        """Build the layout of a robot's arms, by their labels, as far as no world is needed."""
        homes = np.concatenate([arm.home for arm in arms.values()])
        chosen = np.array(self.posture) if self.posture else homes
        if chosen.shape != homes.shape:
            raise ShapeError("The posture", chosen.shape, str(homes.shape))
        ends = pairwise(accumulate((arm.dof for arm in arms.values()), initial=0))
        postures = [chosen[start:end] if self.resolution == POSTURE else None for start, end in ends]
        return Layout.of_spaces(
            {
                label: make_arm_space(self.space, arm, rotation=rotation, posture=posture)
                for (label, arm), posture in zip(arms.items(), postures, strict=True)
            },
            chunk_of(self.space),
        )


def _decoders() -> dict[str, Decoder]:
    table = {}
    for prefix in ("", RELATIVE):
        table |= {prefix + space: Decoder(prefix + space) for space in SPACES if space != TASK}
        table |= {f"{prefix}{TASK}-{resolution}": Decoder(prefix + TASK, resolution) for resolution in RESOLUTIONS}
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
