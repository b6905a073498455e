"""A joint-level environment that takes encoded actions: decoding happens inside, at the true joint angles."""

from collections.abc import Sequence
from itertools import accumulate
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_il.arms.arm import Vector
from er_il.control.commander import BEST_EFFORT, Command, DecodedAhead, Tally
from er_il.control.vector_commander import VectorCommander
from er_il.envs.decoders import Decoder
from er_il.envs.protocol import BEYOND_SUCCESS, openings_of, robot_env
from er_il.envs.tasks import task_id
from er_il.kinematics.solver import Status
from er_il.spaces.base import ArmSpace
from er_il.spaces.layout import Layout
from er_il.support.episode_end import Step, after_the_end
from er_il.support.errors import NotResetError

LEROBOT_OPTIONS = "lerobot_"  # with which the options begin that LeRobot gives a reset
INVALID_ACTION = "invalid_action"  # the failure of an episode that an invalid action stopped


class Query(NamedTuple):
    """What an arm's action is decoded from."""

    action: Vector  # (dim,)
    measured: Vector  # (n,) [rad]
    last: Vector  # (n,) [rad] the last command


class ActionSpaceEnv(
    gymnasium.Wrapper[Any, NDArray[np.float32], Any, NDArray[np.float32]], gymnasium.utils.RecordConstructorArgs
):
    """Wraps a joint-level environment so that its action is an action space's, and the gripper's opening.

    The action's Box is that of the space: finite for deltas. ``info`` gains, at every step, ``command`` (n,) [rad]
    as sent to the arm, ``decode_status`` (a :class:`er_il.Status` value) and ``joint_step`` [rad], the largest joint
    change asked for; ``tally`` sums the episode up. Of several arms, ``command`` holds one after the other, and
    ``decode_status`` is the first that is not ``ok``.

    Numbers that mean nothing (NaN, infinity) are a policy's answer: the step is taken with the status ``invalid``, and
    ``on_invalid`` says what the arm does. What is no vector of numbers of the space's shape is a mistake of the
    program: :meth:`step` refuses it, and the world stays as it is. Once an episode has ended, :meth:`step` repeats its
    last answer, without reward, until the next reset.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], space: ArmSpace | Layout, on_invalid: str = BEST_EFFORT) -> None:
        """Wrap ``env``, whose actions are the arm's n joint targets [rad] and the gripper's opening, or several arms'.

        Args:
            env: A joint-level environment (:mod:`er_il.envs.protocol`).
            space: The arm's action space, or the layout of the environment's arms (:meth:`Layout.of_spaces`).
            on_invalid: See :class:`er_il.control.commander.Commander`.
        """
        gymnasium.utils.RecordConstructorArgs.__init__(self, space=space, on_invalid=on_invalid, _disable_deepcopy=True)
        gymnasium.Wrapper.__init__(self, env)
        self.world = robot_env(env)
        self._openings = openings_of(self.world)
        self.layout = space if isinstance(space, Layout) else Layout.of_space(space)
        self._commander = VectorCommander(self.layout, 1.0 / env.metadata["render_fps"], on_invalid)
        self._ends = list(accumulate(part.space.arm.dof for part in self.layout.parts))[:-1]
        self.ahead: Sequence[DecodedAhead] | None = None  # each arm's part of the next action, if decoded already
        self._last: Step | None = None  # of an episode that has ended
        self._beyond_success = False
        self._started = False
        bounds = zip(*(part.space.bounds for part in self.layout.parts), strict=True)
        grippers = np.zeros(len(self.layout.parts))
        low, high = (self.layout.join_encoded(each, grippers + i) for i, each in enumerate(bounds))
        self.action_space = gymnasium.spaces.Box(low.astype(np.float32), high.astype(np.float32))

    @property
    def space(self) -> ArmSpace:
        """The action space of the only arm.

        Raises:
            ValueError: there are several.
        """
        (part,) = self.layout.parts
        return part.space

    @property
    def tally(self) -> Tally:
        """Counts of the episode's decoded actions; those of several arms summed up."""
        return Tally.sum([arm.tally for arm in self._commander.arms])

    @property
    def last_command(self) -> Vector:
        """The joint angles (n,) [rad] that were commanded last, which a delta counts from; one arm after the other."""
        return np.concatenate([arm.last for arm in self._commander.arms])

    def anchor(self, lead: float = 0.0) -> None:
        """Let the next change count from where the arms are, or from the last command as far as it is near.

        Args:
            lead: How far [rad] the last command may be before the joint that is farthest behind; from farther away it
                is brought back on a straight line.

        Raises:
            NotResetError: no episode was started.
        """
        if not self._started:
            raise NotResetError
        for arm, q in zip(self._commander.arms, self._measured_arms(), strict=True):
            left = arm.last - q
            if (farthest := np.abs(left).max()) > lead:
                arm.anchor(q + left * (lead / farthest))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start an episode; LeRobot's own options are for its wrappers and end here."""
        own = {name: value for name, value in (options or {}).items() if not name.startswith(LEROBOT_OPTIONS)}
        observation, info = self.env.reset(seed=seed, options=own)
        self._beyond_success = bool(own.get(BEYOND_SUCCESS))
        self._commander.reset(self._measured())
        self.ahead, self._last, self._started = None, None, True
        return observation, info

    def query(self, action: ArrayLike) -> list[Query]:
        """Each arm's part of an action, and what it is decoded from.

        Raises:
            ValueError: as :meth:`step`.
        """
        actions, _ = self._commander.split_action(action)
        if not self._started:
            raise NotResetError
        lasts = (arm.last for arm in self._commander.arms)
        return [Query(*each) for each in zip(actions, self._measured_arms(), lasts, strict=True)]

    def step(self, action: NDArray[np.float32]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Decode an action, and take the step that it commands.

        Raises:
            ValueError: what came is no vector of the space's dimensions, or no episode was started.
        """
        ahead, self.ahead = self.ahead, None
        if self._last is not None or not self._started:
            self.query(action)  # refuses what is no action, and a step before the first reset
            assert self._last is not None
            return after_the_end(self._last, self._last[0])
        commanded = self._commander.command(action, self._measured(), ahead)
        vector, grippers = commanded.vector, self.layout.other_indices
        vector[grippers] = np.clip(vector[grippers], 0.0, 1.0)  # the openings, which are passed through
        observation, reward, terminated, truncated, info = self.env.step(vector.astype(np.float32))
        info = info | _told(commanded.arms)
        if any(arm.stopped for arm in commanded.arms) and not info["is_success"]:
            terminated = True
            info["failure"] = INVALID_ACTION
        step = observation, float(reward), terminated, truncated, info
        goes_on = info["is_success"] and self._beyond_success and not truncated
        self._last = step if (terminated or truncated) and not goes_on else None
        return step

    def _measured(self) -> Vector:
        return self.layout.join(self._measured_arms(), self._openings())

    def _measured_arms(self) -> list[Vector]:
        """Each arm's true joint angles (n,) [rad]."""
        return np.split(self.world.joint_positions, self._ends)


def _told(arms: Sequence[Command]) -> dict[str, Any]:
    """What ``info`` says of the commands of a step."""
    status = next((arm.status for arm in arms if arm.status is not Status.OK), Status.OK)
    joint_step = max(arm.joint_step for arm in arms)
    return {"command": np.concatenate([arm.q for arm in arms]), "decode_status": str(status), "joint_step": joint_step}


def make_action_space_env(
    task: str, decoder: Decoder, *, rotation: str = "quat", on_invalid: str = BEST_EFFORT, **kwargs: Any
) -> ActionSpaceEnv:
    """Make a task's environment with a decoder's action space.

    Args:
        task: Name of the task, or Gymnasium id of a joint-level environment.
        decoder: The action space and its resolution.
        rotation: ``quat``, ``rot6d`` or ``rot6d_rows``.
        on_invalid: See :class:`er_il.control.commander.Commander`.
        kwargs: Passed on to ``gymnasium.make``.

    Raises:
        ErIlError: it is no arm environment, or does not tell what the decoder needs.
    """
    env = gymnasium.make(task_id(task), **kwargs)
    return ActionSpaceEnv(env, decoder.layout_in(env, rotation), on_invalid)
