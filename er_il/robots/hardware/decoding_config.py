"""Options of the robot that takes encoded actions: the robot inside, and what the actions mean."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from draccus import ChoiceRegistry
from lerobot.robots import RobotConfig

from er_il.control.commander import BEST_EFFORT, check_answer
from er_il.datasets.schema import STATE
from er_il.datasets.wiring import Wiring, read_wirings, wire
from er_il.robots.command_line import DECODING_ROBOT, RobotCommand
from er_il.robots.described_actions import DescribedActions, check_policy, described_actions
from er_il.spaces.registry import ERJ
from er_il.spaces.spec import ACTION
from er_il.support.errors import ErIlError


class InnerRobotConfig(ChoiceRegistry):
    """Any :class:`RobotConfig` but the decoding one, whose options would hold themselves without end."""

    @classmethod
    def get_known_choices(cls) -> dict[str, Any]:
        return {name: each for name, each in RobotConfig.get_known_choices().items() if name != DECODING_ROBOT}

    @classmethod
    def get_choice_class(cls, name: str) -> Any:
        return cls.get_known_choices()[name]


@RobotConfig.register_subclass(DECODING_ROBOT)
@dataclass(kw_only=True)
class DecodingRobotConfig(RobotConfig):
    """A robot with the decoder inside.

    What its actions mean is said by ``spec``, or by ``arm`` or ``arms`` with ``action_space``, ``rotation`` and
    ``fps``; without any of them, by the policy that the command names.

    Attributes:
        inner: The robot that moves, with all its options.
        spec: Folder of a dataset, a policy or a training's output, or a policy's Hub id, whose actions it takes.
        arm: Preset of its arm, whose joints are named as in the URDF.
        units: Units of that arm's joints: ``deg``, as LeRobot's robots, or ``rad``.
        arms: YAML file of its arms, as ``er-il encode --arms`` reads it, in place of ``arm`` and ``units``.
        action_space: ``task``, ``erj``, ``era`` or ``joint``.
        rotation: ``quat``, ``rot6d`` or ``rot6d_rows``.
        fps: Rate of control [Hz], for which commands keep the arm's velocity limits; the dataset's if 0.
        on_invalid: The answer to an invalid action: ``best_effort``, ``hold``, ``stop``.
    """

    inner: InnerRobotConfig
    spec: str = ""
    arm: str = ""
    units: str = "deg"
    arms: str = ""
    action_space: str = ERJ
    rotation: str = "quat"
    fps: float = 0.0
    on_invalid: str = BEST_EFFORT

    def __post_init__(self) -> None:
        super().__post_init__()
        check_answer(self.on_invalid)

    def actions(self, action_names: tuple[str, ...], state_names: tuple[str, ...]) -> DescribedActions:
        """The actions that the robot takes.

        Args:
            action_names: Names of the inner robot's actions.
            state_names: Names of the numbers that it observes.

        Raises:
            ErIlError: the options do not say it, contradict each other or the policy that the command names, or name
                what is not there.
        """
        sources = [self.spec, self.arm, self.arms]
        policy = RobotCommand.read(sys.argv[1:]).policy
        if sum(map(bool, sources)) > 1:
            raise ErIlError("Give one of --robot.spec, --robot.arm and --robot.arms: each says what the actions mean.")
        if not any(sources) and not policy:
            raise ErIlError(
                "What do the actions mean? Give --robot.spec (a dataset or policy), --robot.arm (a preset) or "
                "--robot.arms (a file of arms)."
            )
        if self.arm or self.arms:
            actions = self._declared(action_names, state_names)
        else:
            actions = described_actions(self.spec or policy)
        if policy:
            check_policy(policy, actions.layout)
        return DescribedActions(actions.layout, self.fps or actions.rate)

    def _declared(self, action_names: tuple[str, ...], state_names: tuple[str, ...]) -> DescribedActions:
        if self.fps <= 0:
            raise ErIlError("At which rate do the actions come? Give --robot.fps, the same as the command's.")
        wirings = [Wiring(arm=self.arm, units=self.units)] if self.arm else read_wirings(Path(self.arms))
        features: Mapping[str, Any] = {
            ACTION: {"names": list(action_names), "shape": (len(action_names),)},
            STATE: {"names": list(state_names), "shape": (len(state_names),)},
        }
        return DescribedActions(wire(wirings, features, self.action_space, self.rotation), self.fps)
