"""Environments for reinforcement learning: delta actions of every space in [-1, 1], decided at 10 Hz (paper V-A).

In every mode a decision takes the same simulated time, and deltas count from the last command, unless asked otherwise.
Against an obstacle the command stays ``LEAD`` before the joints: otherwise it would wind up, and take as many decisions
to be taken back. An action that the arm cannot do is invalid: the arm holds, and the step earns nothing.
"""

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from er_il.control.commander import BEST_EFFORT, HOLD, Tally
from er_il.envs.learning_state import LearningState
from er_il.envs.protocol import BEYOND_SUCCESS, learnable_env
from er_il.envs.tasks import task_id, task_names
from er_il.envs.wrapper import ActionSpaceEnv
from er_il.kinematics.solver import Status
from er_il.spaces.carried import CARRIED
from er_il.spaces.delta import PREFIX, DeltaBounds, DeltaSpace
from er_il.spaces.joint import JOINT
from er_il.spaces.registry import AT, CARRIERS, ERA, ERJ, PLAIN, make_arm_space
from er_il.support.episode_end import Step
from er_il.support.errors import UnknownNameError
from er_il.support.vectors import named_vector

RATE = 10  # [Hz] of decisions
LEAD = 0.1  # [rad] of a command before the joints, beyond which a change does not count from it
BOUNDS = DeltaBounds(position=0.05, rotation=0.05, angle=0.075)  # the paper's largest changes of a decision
SUCCESSES, INVALIDS = 10, 5  # in a row, after which an episode is truncated
EQUAL, SETTLED = PACES = ("equal", "settled")
COMMAND, MEASURED = ANCHORS = ("command", "measured")
STEP_RATE = 20  # [Hz] of the simulator steps that the paper's code counts
STEPS, ARM_ANGLE_STEPS, JOINT_STEPS = 50, 10, 1  # of these at most to a decision
DECISIONS = 200  # to an episode, however long they take
STILL, NEAR = 0.05, 0.01  # [rad/s] and [rad] from its command at which an arm has settled
CAMERAS, IMAGE_SIZE = ("wrist", "front"), 84  # the paper's
PIXELS, STATE = "pixels", "state"
FREE = "-free"  # of ERJ as the paper's text defines it, and likewise of ERX
MODES = (*PLAIN, *(space + FREE for space in CARRIERS))


def space_name(mode: str) -> str:
    """The action space of a mode: changes of a space's commands.

    ``erj`` carries the hand along, as the paper's code does; ``erj-free`` is ERJ of its text. Both take the joints that
    they command behind an ``@``, as in ``erj@panda_joint3``. So do ``erx`` and ``erx-free`` with their weights.

    Raises:
        UnknownNameError: no such mode.
    """
    kind, at, joints = mode.partition(AT)
    if kind not in MODES:
        raise UnknownNameError("mode", mode, MODES)
    return (CARRIED if kind in CARRIERS else PREFIX) + kind.removesuffix(FREE) + at + joints


class LearningEnv(gymnasium.Env[Any, NDArray[np.float32]]):
    """A task as reinforcement learning sees it; stock libraries need nothing else.

    Action: Box [-1, 1] of the mode's dimensions, in shares of the paper's largest changes, and the gripper's opening
    from closed (-1) to open (1); an attached grasp is open from 0 on. Observation: the state as a flat Box
    (:class:`er_il.envs.learning_state.LearningState`), or with ``pixels`` a Dict of two images (84, 84, 3) and the
    robot's part of the state. Reward: the task's, in [0, 1].

    An invalid action (its decoding is not OK; in joint space only what is not finite, since a joint stops at its limit)
    holds the last command for the decision's time and earns 0. Failures that the task calls irreversible terminate an
    episode, with reward 0; it is truncated after ``SUCCESSES`` successful steps or ``INVALIDS`` invalid actions in a
    row, and after ``DECISIONS``. ``info`` has ``is_success``, ``failure``, ``invalid``, ``invalid_actions`` (the
    episode's count), ``decode_status`` and ``reward_terms``.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": RATE}  # noqa: RUF012  as Gymnasium declares it

    def __init__(
        self,
        task: str,
        mode: str = ERJ,
        *,
        pixels: bool = False,
        arm: str = "panda",
        pace: str = EQUAL,
        anchor: str = COMMAND,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        """Make the task's environment in a mode.

        Args:
            task: Name of the task, or Gymnasium id of an environment that is learnable
                (:class:`er_il.envs.protocol.LearnableEnv`).
            mode: One of ``MODES``, see :func:`space_name`.
            pixels: Observe images of the cameras wrist and front instead of the objects.
            arm: Preset that does the task.
            pace: ``equal``, or ``settled`` for the time that the paper's code gives to a decision: until the arm has
                settled, at most 2.5 s, in the mode ``era`` 0.5 s; in joint space 0.05 s.
            anchor: What deltas count from: the last ``command``, or the ``measured`` joints as in the paper's code.
            render_mode: ``rgb_array`` for :meth:`render`.
            settings: Keyword arguments of the task, such as its randomisation.

        Raises:
            UnknownNameError: no such task, mode, pace or anchor, or arm for it.
            ArmError: the arm has no such space.
        """
        cameras = {"cameras": CAMERAS, "image_size": IMAGE_SIZE} if pixels else {}
        name = space_name(mode)
        for what, given, valid in (("pace", pace, PACES), ("anchor", anchor, ANCHORS)):
            if given not in valid:
                raise UnknownNameError(what, given, valid)
        self._lead = 0.0 if anchor == MEASURED else LEAD
        self._steps = _most_steps(mode) if pace == SETTLED else 0  # of the simulator in a decision; 0: one period
        own_limit = {"max_steps": DECISIONS * STEPS, "max_episode_steps": -1} if self._steps else {}
        world = gymnasium.make(
            task_id(task),
            arm=arm,
            rate=STEP_RATE if self._steps else RATE,
            **own_limit,
            render_mode=render_mode,
            disable_env_checker=True,  # checks every step of the inner environment
            **cameras,  # pyrefly: ignore[bad-argument-type]
            **settings,
        )
        self.world, self.task = learnable_env(world), task
        space = make_arm_space(name, self.world.arm, bounds=BOUNDS)
        assert isinstance(space, DeltaSpace)
        self._invalid = {Status.INVALID} if mode == JOINT else set(Status) - {Status.OK}
        self._env = ActionSpaceEnv(world, space, BEST_EFFORT if mode == JOINT else HOLD)
        self.space, self._scale = space, space.limits
        self.seen: Mapping[str, Any] = {}  # what the world, joint-level, was last observed to be
        self._names = (*space.names, "gripper")
        self._state = LearningState(self.world, objects=not pixels)
        self.render_mode = render_mode
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (len(self._names),), np.float32)
        self._pixels = pixels
        state = self._state.space
        self.observation_space = state
        if pixels:
            image = gymnasium.spaces.Box(0, 255, (IMAGE_SIZE, IMAGE_SIZE, 3), np.uint8)
            self.observation_space = gymnasium.spaces.Dict({**dict.fromkeys(CAMERAS, image), STATE: state})
        self._successes = self._invalids = self._invalid_actions = self._decisions = 0

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the state's dimensions."""
        return self._state.names

    @property
    def action_names(self) -> tuple[str, ...]:
        """Names of an action's dimensions."""
        return self._names

    @property
    def tally(self) -> Tally:
        """Counts of the episode's decoded actions."""
        return self._env.tally

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start an episode; for the options see the task."""
        super().reset(seed=seed)
        observation, info = self._env.reset(seed=seed, options={**(options or {}), BEYOND_SUCCESS: True})
        self._successes = self._invalids = self._invalid_actions = self._decisions = 0
        return self._observe(observation), info | {"invalid": False, "invalid_actions": 0}

    def step(self, action: NDArray[np.float32]) -> Step:
        """Take a decision, of 0.1 s unless the pace is another one.

        Raises:
            ValueError: what came is no vector of the mode's dimensions, or no episode was started.
        """
        observation, reward, terminated, truncated, info = self._decide(self.change(action))
        invalid = Status(info["decode_status"]) in self._invalid
        failed = terminated and bool(info["failure"])
        self._invalids = self._invalids + 1 if invalid else 0
        self._invalid_actions += invalid
        self._successes = self._successes + 1 if info["is_success"] else 0
        self._decisions += 1
        truncated = truncated or self._successes >= SUCCESSES or self._invalids >= INVALIDS
        truncated = truncated or self._decisions >= DECISIONS
        info = info | {"invalid": invalid, "invalid_actions": self._invalid_actions}
        earned = 0.0 if invalid or failed else reward
        return self._observe(observation), earned, failed, truncated and not failed, info

    def _decide(self, change: NDArray[Any]) -> Step:
        """Command a change, and wait until the arm has settled if the pace is such."""
        self._env.anchor(self._lead)
        step = self._env.step(change)
        status = step[4]["decode_status"]
        hold = np.append(np.zeros(len(change) - 1), change[-1])
        for _ in range(self._steps - 1):
            if step[2] or step[3] or self._settled():
                break
            step = self._env.step(hold)
        return *step[:4], step[4] | {"decode_status": status}

    def _settled(self) -> bool:
        lead, velocity = self._env.last_command - self.world.joint_positions, self.world.joint_velocities
        return bool(np.abs(lead).max() < NEAR and np.abs(velocity).max() < STILL)

    def change(self, action: NDArray[np.float32]) -> NDArray[Any]:
        """What an action (dim,) in [-1, 1] asks for: the change in the space's units, and the gripper's opening.

        Raises:
            ValueError: what came is no vector of the mode's dimensions.
        """
        given = np.clip(named_vector("The action", action, self._names), -1.0, 1.0)
        return np.append(given[:-1] * self._scale, (given[-1] + 1.0) / 2.0)

    def render(self) -> Any:
        """A picture (H, W, 3) uint8 of the scene for people."""
        return self._env.render()

    def close(self) -> None:
        """Free the rendering contexts."""
        self._env.close()

    def _observe(self, observation: dict[str, Any]) -> Any:
        self.seen = observation
        state = self._state.observe(observation, self._env.last_command)
        return {**observation[PIXELS], STATE: state} if self._pixels else state


def make_rl_env(task: str, mode: str = ERJ, **settings: Any) -> LearningEnv:
    """Make a task's environment for reinforcement learning; for the arguments see :class:`LearningEnv`."""
    return LearningEnv(task, mode, **settings)


def _most_steps(mode: str) -> int:
    """The simulator steps of a decision in the paper's code."""
    kind = mode.partition(AT)[0]
    return {JOINT: JOINT_STEPS, ERA: ARM_ANGLE_STEPS}.get(kind, STEPS)


def _register() -> None:
    """Register every task that is there now in every mode: ``er_il/StackWine-erj-v0``."""
    for task in task_names():
        name = task_id(task).partition("/")[2].rpartition("-v")[0]
        for mode in MODES:
            gymnasium.register(
                f"er_il/{name}-{mode}-v0",
                entry_point=f"{__name__}:{LearningEnv.__name__}",
                kwargs={"task": task, "mode": mode},
            )


_register()
