"""The interface of a joint-level arm environment, by which er_il knows simulated tasks, its own and others'."""

from collections.abc import Iterator, Sequence
from typing import Any, Protocol, runtime_checkable

import gymnasium
import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Arm, Vector
from er_il.support.errors import ErIlError
from er_il.support.shapes import Shape

BEYOND_SUCCESS = "beyond_success"


@runtime_checkable
class ArmEnv(Protocol):
    """A Gymnasium environment of one arm and its gripper, commanded in joint positions.

    Action: (n + 1,) joint position targets [rad] and the gripper's opening in [0, 1] (1 open). Observation: a dict
    with ``agent_pos`` (joint positions, gripper opening, end-effector position and quaternion), ``environment_state``
    (object poses) and, with cameras, ``pixels``. Every ``info`` holds ``is_success`` and ``failure`` ("" if none).
    """

    arm: Arm
    task_description: str

    @property
    def joint_positions(self) -> Vector:
        """The arm's true joint angles (n,) [rad]."""
        ...

    @property
    def gripper_opening(self) -> float:
        """The gripper's true opening in [0, 1]."""
        ...

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of ``agent_pos``."""
        ...

    @property
    def environment_state_names(self) -> tuple[str, ...]:
        """Names of ``environment_state``."""
        ...

    def scene_geometry(self) -> Sequence[Shape]:
        """The world around the robot as shapes to draw, as of the last reset."""
        ...

    def render(self) -> Any:
        """A picture (H, W, 3) uint8 of the scene for people."""
        ...


@runtime_checkable
class DemonstrableEnv(ArmEnv, Protocol):
    """An arm environment with a scripted leader.

    A recording goes on to the leader's end: it resets with ``options={"beyond_success": True}``, after which success
    must neither stop the world nor the judgement of it.
    """

    def leader(self, seed: int) -> Iterator[NDArray[np.float64]]:
        """The actions (n + 1,) of a demonstration of the episode just reset, one a control period.

        Raises:
            PlanError: no collision-free motion exists; known before the first action.
        """
        ...


@runtime_checkable
class LearnableEnv(ArmEnv, Protocol):
    """An arm environment for reinforcement learning: its reward is in [0, 1], and it tells more of its state.

    It is made for a control ``rate`` [Hz], and judges on beyond success as a :class:`DemonstrableEnv` does.
    """

    @property
    def joint_velocities(self) -> Vector:
        """The arm's true joint velocities (n,) [rad/s]."""
        ...

    @property
    def grasped(self) -> bool:
        """True if the hand holds a thing."""
        ...


@runtime_checkable
class ClearanceEnv(ArmEnv, Protocol):
    """An arm environment that tells how far the arm would be from the world: what no robot knows."""

    def clearances(self, q: Vector, most: float) -> Vector:
        """Distances (L,) [m] between links and the world as it is now, were the arm at q (n,) [rad].

        The links are those whose place the pose of the hand leaves open, the world everything but the robot and what
        the task has it touch. Distances are at most ``most`` [m], and negative where shapes overlap.
        """
        ...


def arm_env(env: gymnasium.Env[Any, Any]) -> ArmEnv:
    """The arm environment under an environment's wrappers.

    Raises:
        ErIlError: it is none.
    """
    return _inner(env, ArmEnv, "arm environment")


def demonstrable_env(env: gymnasium.Env[Any, Any]) -> DemonstrableEnv:
    """The arm environment under an environment's wrappers, with its leader.

    Raises:
        ErIlError: it is none, or has no leader.
    """
    return _inner(env, DemonstrableEnv, "arm environment with a leader")


def learnable_env(env: gymnasium.Env[Any, Any]) -> LearnableEnv:
    """The arm environment under an environment's wrappers, with what reinforcement learning observes.

    Raises:
        ErIlError: it is none.
    """
    return _inner(env, LearnableEnv, "environment for reinforcement learning")


def clearance_env(env: gymnasium.Env[Any, Any]) -> ClearanceEnv:
    """The arm environment under an environment's wrappers, with its arm's distances to the world.

    Raises:
        ErIlError: it is none, or does not tell them.
    """
    return _inner(env, ClearanceEnv, "environment for task-clear, which needs the arm's true distances to the world")


def _inner[T: ArmEnv](env: gymnasium.Env[Any, Any], protocol: type[T], what: str) -> T:
    inner = env.unwrapped
    if not isinstance(inner, protocol):
        name = env.spec.id if env.spec else type(inner).__name__
        members = dict.fromkeys((*ArmEnv.__annotations__, *vars(ArmEnv), *vars(protocol)))
        missing = [member for member in members if not member.startswith("_") and not hasattr(inner, member)]
        raise ErIlError(f"{name} is no {what}: it lacks {', '.join(missing)}.")
    return inner
