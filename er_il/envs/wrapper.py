"""A joint-level environment that takes encoded actions: decoding happens inside, at the true joint angles."""

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from er_il.control.commander import BEST_EFFORT, Commander
from er_il.envs.decoders import Decoder
from er_il.spaces import ActionSpace

INVALID_ACTION = "invalid_action"  # the failure of an episode that an invalid action stopped


class DecodingEnv(
    gymnasium.Wrapper[Any, NDArray[np.float32], Any, NDArray[np.float32]], gymnasium.utils.RecordConstructorArgs
):
    """Wraps a joint-level environment so that its action is an action space's.

    ``info`` gains, at every step, ``command`` (n,) [rad] as sent to the arm, ``decode_status`` (a
    :class:`er_il.Status` value) and ``joint_step`` [rad], the largest joint change asked for;
    ``commander.tally`` sums the episode up.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], space: ActionSpace, on_invalid: str = BEST_EFFORT) -> None:
        """Wrap ``env``, whose actions are the arm's n joint targets [rad] and the gripper's opening."""
        gymnasium.utils.RecordConstructorArgs.__init__(self, space=space, on_invalid=on_invalid, _disable_deepcopy=True)
        gymnasium.Wrapper.__init__(self, env)
        self.space = space
        self.commander = Commander(space, 1.0 / env.metadata["render_fps"], on_invalid)
        self.action_space = gymnasium.spaces.Box(-np.inf, np.inf, (space.dim,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        observation, info = self.env.reset(seed=seed, options=options)
        world: Any = self.unwrapped
        self.commander.reset(world.joint_positions, world.gripper_opening)
        return observation, info

    def step(self, action: NDArray[np.float32]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        world: Any = self.unwrapped
        command = self.commander.command(action, world.joint_positions)
        target = np.append(command.q, command.gripper).astype(np.float32)
        observation, reward, terminated, truncated, info = self.env.step(target)
        info = info | {
            "command": command.q,
            "decode_status": str(command.status),
            "joint_step": command.joint_step,
        }
        if command.stopped and not info["is_success"]:
            terminated = True
            info["failure"] = INVALID_ACTION
        return observation, float(reward), terminated, truncated, info


def make_decoding_env(
    task_id: str, decoder: Decoder, *, rotation: str = "quat", on_invalid: str = BEST_EFFORT, **kwargs: Any
) -> DecodingEnv:
    """Make a task's environment, by Gymnasium id, with a decoder's action space.

    Args:
        task_id: Gymnasium id of a joint-level environment.
        decoder: The action space and its resolution.
        rotation: ``quat`` or ``rot6d``.
        on_invalid: See :class:`er_il.control.commander.Commander`.
        kwargs: Passed on to ``gymnasium.make``.
    """
    env = gymnasium.make(task_id, **kwargs)
    world: Any = env.unwrapped
    return DecodingEnv(env, decoder.action_space(world.arm, rotation), on_invalid)
