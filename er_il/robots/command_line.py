"""Which policy a command of LeRobot's lets move which robot, read off its arguments.

LeRobot tells neither a robot nor a plugin about the policy. Its own configurations find a policy's path in the
arguments of the process (:func:`lerobot.configs.parser.get_path_arg`); so does this.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from lerobot.configs import parser

DECODING_ROBOT = "er_il_arm"  # type of the robot that takes encoded actions

POLICY, SERVED = "policy.path", "pretrained_name_or_path"  # of lerobot-rollout, and of the asynchronous robot client


@dataclass(frozen=True)
class RobotCommand:
    """What a command says; empty where it says nothing."""

    robot: str = ""  # type
    policy: str = ""  # folder, or Hub id
    served: bool = False  # an asynchronous policy server loads the policy
    leader: str = ""  # type of the teleoperator
    dataset: str = ""  # that it records or replays
    strategy: str = ""  # of a rollout
    inference: str = ""  # of a rollout, such as "rtc"

    @classmethod
    def read(cls, arguments: Sequence[str]) -> "RobotCommand":
        """Read a command's arguments, and the configuration file that they may name; arguments win."""
        file = _configuration(_last("config_path", arguments))

        def said(*options: str) -> str:
            given = (_last(option, arguments) or _lookup(file, option) for option in options)
            return next((value for value in given if value), "")

        return cls(
            robot=said("robot.type"),
            policy=said(POLICY, SERVED),
            served=bool(said(SERVED)),
            leader=said("teleop.type"),
            dataset=said("dataset.repo_id"),
            strategy=said("strategy.type"),
            inference=said("inference.type"),
        )


def _last(option: str, arguments: Sequence[str]) -> str:
    """The last value of an option, which counts; "" if it is not given."""
    pairs = (arguments[index : index + 2] for index in range(len(arguments)))
    values = [value for value in (parser.parse_arg(option, pair) for pair in pairs) if value is not None]
    return values[-1] if values else ""


def _configuration(path: str) -> Mapping[str, Any]:
    if not Path(path).is_file():
        return {}  # LeRobot says what is wrong with it
    try:
        values = yaml.safe_load(Path(path).read_text())  # JSON is YAML
    except (yaml.YAMLError, UnicodeDecodeError):
        return {}
    return values if isinstance(values, dict) else {}


def _lookup(values: Any, option: str) -> str:
    for key in option.split("."):
        values = values.get(key) if isinstance(values, dict) else None
    return values if isinstance(values, str) else ""
