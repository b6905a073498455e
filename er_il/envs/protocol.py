"""The interface of a joint-level arm environment, by which er_il knows simulated tasks, its own and others'."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import accumulate, chain
from typing import Any, Protocol, runtime_checkable

import gymnasium
import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Arm, Vector
from er_il.support.errors import ErIlError
from er_il.support.shapes import Shape

BEYOND_SUCCESS = "beyond_success"


@runtime_checkable
class RobotEnv(Protocol):
    """What environments of one arm and of several have in common.

    Observation: a dict with ``agent_pos`` (it begins with the joint positions, one arm after the other),
    ``environment_state`` (object poses) and, with cameras, ``pixels``. Every ``info`` holds ``is_success`` and
    ``failure`` ("" if none).
    """

    task_description: str

    @property
    def joint_positions(self) -> Vector:
        """The true joint angles (n,) [rad], one arm after the other."""
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
class ArmEnv(RobotEnv, Protocol):
    """A Gymnasium environment of one arm and its gripper, commanded in joint positions.

    Action: (n + 1,) joint position targets [rad] and the gripper's opening in [0, 1] (1 open). Behind the joint
    positions, ``agent_pos`` holds the gripper's opening and the end effector's position and quaternion.
    """

    arm: Arm

    @property
    def gripper_opening(self) -> float:
        """The gripper's true opening in [0, 1]."""
        ...


@runtime_checkable
class ArmsEnv(RobotEnv, Protocol):
    """A Gymnasium environment of several arms with a gripper each, commanded in joint positions.

    Action: of each arm in turn, its joint position targets [rad] and its gripper's opening in [0, 1] (1 open).
    """

    arms: Mapping[str, Arm]  # by label

    @property
    def gripper_openings(self) -> Vector:
        """The grippers' true openings in [0, 1], one an arm."""
        ...


@runtime_checkable
class DemonstrableEnv(RobotEnv, Protocol):
    """An environment with a scripted leader.

    A recording goes on to the leader's end: it resets with ``options={"beyond_success": True}``, after which success
    must neither stop the world nor the judgement of it.
    """

    def leader(self, seed: int) -> Iterator[NDArray[np.float64]]:
        """The actions of a demonstration of the episode just reset, one a control period.

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
class DirectedEnv(LearnableEnv, Protocol):
    """A learnable environment that tells what its reward depends on, from which agents learn better than from poses.

    Names are the same in every episode, whatever the task asks for in it.
    """

    @property
    def ways(self) -> Mapping[str, Vector]:
        """Vectors (3,) in the base frame by name, distances [m] or turns [rad]: of most, nothing is left in the end."""
        ...

    @property
    def directions(self) -> Mapping[str, Vector]:
        """Unit vectors (3,) in the base frame by name: axes of things."""
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


def arms_of(world: RobotEnv) -> Mapping[str, Arm]:
    """The arms of an environment by their labels, in the order of its vectors; a single one has the label ""."""
    return world.arms if isinstance(world, ArmsEnv) else {"": _one_arm(world).arm}


def openings_of(world: RobotEnv) -> Callable[[], Vector]:
    """Reads the true openings of an environment's grippers in [0, 1], one an arm."""
    if isinstance(world, ArmsEnv):
        return lambda: world.gripper_openings
    one = _one_arm(world)
    return lambda: np.array([one.gripper_opening])


def gripper_columns(world: RobotEnv) -> list[int]:
    """Where in an environment's actions the grippers are."""
    return [end - 1 for end in accumulate(arm.dof + 1 for arm in arms_of(world).values())]


def robot_env(env: gymnasium.Env[Any, Any]) -> RobotEnv:
    """The environment of one arm or several under an environment's wrappers.

    Raises:
        ErIlError: it is none.
    """
    return env.unwrapped if isinstance(env.unwrapped, ArmsEnv) else arm_env(env)


def arm_env(env: gymnasium.Env[Any, Any]) -> ArmEnv:
    """The arm environment under an environment's wrappers.

    Raises:
        ErIlError: it is none.
    """
    return _inner(env, ArmEnv, "arm environment")


def demonstrable_env(env: gymnasium.Env[Any, Any]) -> DemonstrableEnv:
    """The environment under an environment's wrappers, with its leader.

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


def _one_arm(world: RobotEnv) -> ArmEnv:
    assert isinstance(world, ArmEnv)
    return world


def _inner[T: RobotEnv](env: gymnasium.Env[Any, Any], protocol: type[T], what: str) -> T:
    inner = env.unwrapped
    if not isinstance(inner, protocol):
        name = env.spec.id if env.spec else type(inner).__name__
        bases = protocol.__mro__[: protocol.__mro__.index(RobotEnv) + 1]
        members = dict.fromkeys(chain(*(base.__annotations__ for base in bases), *map(vars, bases)))
        missing = [member for member in members if not member.startswith("_") and not hasattr(inner, member)]
        raise ErIlError(f"{name} is no {what}: it lacks {', '.join(missing)}.")
    return inner
