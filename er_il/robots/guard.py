"""No unattached policy moves an arm: commands of LeRobot's that would send encoded actions to joints are refused.

LeRobot 0.6.1 gives a policy's numbers to the robot's joints by their places in the vector: eight numbers of a pose and
a gripper move seven joints and a gripper without a word. What it loads on the way says nothing of their meaning, and
has no place for a check. But it imports this plugin at the start of every command that moves a robot, before it loads
the policy and connects the robot; that is where :func:`check_command` runs.
"""

import logging
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
from safetensors import safe_open

from er_il.datasets.schema import LEADER_JOINTS, SOURCE_ACTION, SOURCE_JOINTS
from er_il.envs.contract import Contract, chunk_relative, decodes, policy_tags, read_policy_config
from er_il.envs.origin import at_hand, policy_file, training_info
from er_il.envs.trust import POSTPROCESSOR, read_processor
from er_il.rl.modes import AGENT
from er_il.robots.command_line import DECODING_ROBOT, RobotCommand
from er_il.spaces.chunk import commands_of
from er_il.spaces.joint import JOINT
from er_il.spaces.spec import ACTION, action_spec
from er_il.support.errors import DatasetError, ErIlError, PolicyError

logger = logging.getLogger(__name__)

UNKNOWN = "an unknown"
REAL_TIME_CHUNKING = "rtc"
CLOSE = 0.05  # [units of the joints] between the means of actions that are joints and of these joints


def check_command(arguments: Sequence[str]) -> None:
    """End the process with one line and exit code 2 if a command would move a robot by numbers that are not its own.

    An exception would not do: LeRobot logs what a plugin's import raises, and goes on.

    Args:
        arguments: The command's arguments, without the program's name.
    """
    try:
        check(RobotCommand.read(arguments))
    except ErIlError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
    except Exception as error:  # LeRobot would let a policy that cannot be checked move the robot
        print(f"error: er_il cannot check whether the policy's actions are joints: {error!r}", file=sys.stderr)
        sys.exit(2)


def check(command: RobotCommand) -> None:
    """Refuse a command that would send encoded actions to joints, or record joints as encoded actions.

    Raises:
        PolicyError: the policy was trained in an ER or task space, and nothing decodes its actions; or it acts
            chunk-relative where LeRobot does not let it.
        DatasetError: a leader's joints would be recorded by a robot that takes encoded actions.
    """
    if command.robot and command.policy:
        _check_chunks(command)
    if command.robot == DECODING_ROBOT:
        _check_decoding(command)
    elif command.robot and command.policy:
        _check_policy(command)


def _check_chunks(command: RobotCommand) -> None:
    """Refuse chunk-relative actions where chunks meet: LeRobot knows no state that those of a chunk count from."""
    if not ((command.served or command.inference == REAL_TIME_CHUNKING) and at_hand(command.policy)):
        return
    if chunk_relative(command.policy):
        where = "LeRobot's policy server loads no plugins" if command.served else "Real-time chunking joins chunks"
        raise PolicyError(
            f"The policy {command.policy} acts chunk-relative. {where}, and cannot convert its actions: run it with "
            "lerobot-rollout --inference.type=sync, or train it in an absolute space."
        )


def _check_policy(command: RobotCommand) -> None:
    policy = command.policy
    if at_hand(policy) and read_policy_config(policy)["type"] == AGENT:
        raise PolicyError(
            f"The policy {policy} is an agent of reinforcement learning: it observes what only a simulation knows. "
            "Record its rollouts (er-il generate TASK --agent), and train a policy on them."
        )
    space = action_space_of(policy)
    if space is None or commands_of(space) == JOINT:
        return
    attached = decodes(policy)
    robot = (
        f"Let the robot decode: --robot.type={DECODING_ROBOT} --robot.inner.type={command.robot}, and --robot.inner.… "
        "for its other options."
    )
    if attached and command.served:
        raise PolicyError(
            f"The policy {policy} decodes its actions by itself (er-il attach), which LeRobot's policy server, without "
            f"plugins, does not let it. Take the policy that it was made from. {robot}"
        )
    if not attached:
        copy = "" if command.served else f" Or let a copy of the policy: er-il attach {policy} --out OUT."
        raise PolicyError(
            f"The policy {policy} was trained in {space} action space; {command.robot} would take its numbers for "
            f"joints. {robot}{copy}"
        )


def _check_decoding(command: RobotCommand) -> None:
    if command.policy and at_hand(command.policy) and decodes(command.policy):
        raise PolicyError(
            f"The policy {command.policy} decodes its actions by itself (er-il attach), and {DECODING_ROBOT} would do "
            "it again. Give it the inner robot (--robot.type=…), or take the policy that it was made from."
        )
    # A joint leader has no encoded actions; LeRobot would fail at the first frame, when the robot has moved.
    if command.leader and command.dataset and (not command.policy or command.strategy == "dagger"):
        raise DatasetError(
            f"{DECODING_ROBOT} takes encoded actions, and {command.leader} gives joints. Record them with the inner "
            "robot (--robot.type=…), then encode the dataset: er-il encode DATASET --to SPACE --out OUT."
        )


def action_space_of(policy: str) -> str | None:
    """The action space that a policy was trained in; None if nothing says that it is one of er_il's.

    The dataset that it was trained on knows, else the policy's tag. Where neither is at hand, the statistics do that
    LeRobot saves with a policy, of each column of its dataset: actions that are not the joints which er_il keeps
    beside encoded ones are encoded, in :data:`UNKNOWN` space.

    Raises:
        PolicyError: a file of the policy is damaged.
    """
    if not at_hand(policy):
        logger.warning("er_il cannot check the actions of the policy %s: it is not at hand on this machine.", policy)
        return None
    with suppress(KeyError, TypeError, DatasetError):  # the dataset does not say what its actions mean
        if info := training_info(policy):
            return str(action_spec(info["features"])["space"])
    tagged = Contract.of_tags(policy_tags(policy))
    return tagged.space if tagged else _by_statistics(policy)


def _by_statistics(policy: str) -> str | None:
    for means in _means(policy):
        for column in (LEADER_JOINTS, SOURCE_JOINTS, SOURCE_ACTION):
            if column in means and ACTION in means:
                joints, actions = means[column], means[ACTION]
                same = joints.shape == actions.shape and np.allclose(joints, actions, rtol=0, atol=CLOSE)
                return JOINT if same else UNKNOWN
    return None


def _means(policy: str) -> list[dict[str, np.ndarray]]:
    """The means of the columns of its dataset, as the steps of a policy's post-processor keep them."""
    path = policy_file(policy, POSTPROCESSOR)
    if path is None:
        return []
    found = []
    for step in read_processor(path)["steps"]:
        name = step.get("state_file")
        file = policy_file(policy, name) if isinstance(name, str) and Path(name).name == name else None
        if file is not None:
            with safe_open(file, framework="numpy") as tensors:
                keys = [key for key in tensors.keys() if key.endswith(".mean")]  # noqa: SIM118  it is no mapping
                found.append({key.removesuffix(".mean"): tensors.get_tensor(key) for key in keys})
    return found
