"""The base of every task: a follower arm in a MuJoCo world, commanded in joint positions."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar

import gymnasium as gym
import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.rotation import Quaternion, make_rotation
from er_il.kinematics.solver import kinematics_of
from er_il.support.errors import UnknownNameError
from er_il.support.shapes import POSE_NAMES, Shape
from sim_tasks.leader.leader import Leader
from sim_tasks.leader.motion import Stretch
from sim_tasks.world.camera import Cameras
from sim_tasks.world.contact import contact_force
from sim_tasks.world.geometry import world_shapes
from sim_tasks.world.randomisation import span
from sim_tasks.world.robot import FINGER_BODIES, RobotModel, lift
from sim_tasks.world.scene import scene_spec

RATE = 20  # [Hz] of control
COLLISION_FORCE = 20.0  # [N] at which a Panda's collision reflex stops it, by its makers' default
SUCCESS_STEPS = 5  # consecutive control steps (0.25 s) for which success must hold

_LEADER = 2  # tells the leader's random numbers from the world's, which start from the seed itself

Placement = dict[str, tuple[float, float, float]]  # object: x, y [m], yaw [rad]


class ArmTask(gym.Env[dict[str, Any], np.ndarray], ABC):
    """A task for one arm. Subclasses build the world, place its objects, judge and demonstrate.

    Action: Box(n+1,): joint position targets [rad] and the gripper's opening in [0, 1] (1 open).
    Observation: ``agent_pos`` (n+8,): joint positions [rad], gripper opening, end-effector position
    [m] and quaternion (x, y, z, w); ``environment_state``: position [m] and quaternion (x, y, z, w)
    of each object; ``pixels``: a (size, size, 3) uint8 image a camera, if cameras are asked for.
    Every ``info`` has ``is_success`` and ``failure`` (empty while there is none).
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array"], "render_fps": RATE}  # pyright: ignore[reportIncompatibleVariableOverride]

    task: ClassVar[str]
    task_description: ClassVar[str]
    max_steps: ClassVar[int]
    objects: ClassVar[tuple[str, ...]]  # bodies that move, in the order of environment_state
    obstacles: ClassVar[tuple[str, ...]]  # bodies that the robot must not run into
    arms: ClassVar[tuple[str, ...]] = ("panda",)  # presets that can do the task
    start: ClassVar[tuple[float, ...]]  # (7,) [rad] of the last seven joints; what is below them starts at home

    def __init__(
        self,
        *,
        cameras: Sequence[str] = (),
        image_size: int = 96,
        render_mode: str | None = None,
        arm: str = "panda",
        start_range: float = 0.02,
    ) -> None:
        """Build the world.

        Args:
            cameras: Cameras to observe; none by default, which needs no GL.
            image_size: Side [px] of their square images.
            render_mode: ``rgb_array`` for :meth:`render`.
            arm: Preset of the follower and the leader, one of the task's ``arms``.
            start_range: Each of the last seven joints starts up to this far [rad] from the start posture.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise UnknownNameError("render mode", render_mode, self.metadata["render_modes"])
        if arm not in self.arms:
            raise UnknownNameError(f"arm for {self.task}", arm, self.arms)
        self.arm = Arm.preset(arm)
        # Tasks are measured from a Panda's shoulder: what stands before an arm that is taller stands higher, too.
        self.lift = lift(self.arm)
        self.render_mode = render_mode
        self._start_range = span("start_range", start_range)
        self._model = self._spec().compile()
        self._data = mujoco.MjData(self._model)
        self._robot = RobotModel.of(self._model, self.arm)
        self._fingers = {self._model.body(name).id for name in FINGER_BODIES}
        self._obstacles = {self._model.body(name).id for name in self.obstacles}
        self._substeps = round(1 / RATE / self._model.opt.timestep)
        self._cameras = Cameras(self._model, cameras, image_size)
        self._rotation = make_rotation(Quaternion.kind, kinematics_of(self.arm).fk(self.arm.home)[:3, :3])
        self._quaternion = np.zeros(4)
        self._steps = self._success_steps = 0
        lower, upper = np.append(self.arm.lower, 0.0), np.append(self.arm.upper, 1.0)
        self.action_space = gym.spaces.Box(lower.astype(np.float32), upper.astype(np.float32))
        self.observation_space = self._make_observation_space(image_size)

    def _spec(self) -> mujoco.MjSpec:
        """The whole world: robot and bench with the task's things."""
        spec = scene_spec(self.arm)
        self._build(spec)
        return spec

    @abstractmethod
    def _build(self, spec: mujoco.MjSpec) -> None:
        """Add the task's things to the scene."""

    @abstractmethod
    def _draw(self, rng: np.random.Generator) -> Placement:
        """Draw where the objects stand."""

    @abstractmethod
    def _place(self, placement: Placement) -> None:
        """Put the objects where a placement says."""

    @abstractmethod
    def _succeeds(self) -> bool:
        """Whether the goal holds at this moment."""

    @abstractmethod
    def _fails(self) -> str:
        """Name of what went wrong beyond repair, empty if nothing did."""

    def _collision(self) -> str:
        """Name of running into an obstacle at this moment."""
        return "collision"

    @abstractmethod
    def _times_out(self) -> str:
        """Name of what was missing when the time ran out."""

    @abstractmethod
    def _script(self, rng: np.random.Generator) -> tuple[Sequence[Stretch], float]:
        """Plan the demonstration of the episode just reset: the stretches, and the speed share."""

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of ``agent_pos``."""
        pose = ("ee.x", "ee.y", "ee.z", *Quaternion.names)
        return (*(f"{joint}.pos" for joint in self.arm.joints), "gripper", *pose)

    @property
    def environment_state_names(self) -> tuple[str, ...]:
        """Names of ``environment_state``."""
        return tuple(f"{name}.{part}" for name in self.objects for part in POSE_NAMES)

    @property
    def _nominal_start(self) -> Vector:
        """Joint angles (n,) [rad] around which episodes start."""
        return np.append(self.arm.home[: self.arm.dof - len(self.start)], self.start)

    @property
    def joint_positions(self) -> Vector:
        """The follower's true joint angles (n,) [rad]."""
        return self._data.qpos[self._robot.joint_qpos].copy()

    @property
    def gripper_opening(self) -> float:
        """The gripper's true opening in [0, 1]."""
        return self._robot.opening(self._data)

    @property
    def ee_pose(self) -> np.ndarray:
        """The follower's true end-effector pose T_base_ee (4, 4); the base is the world's origin."""
        return kinematics_of(self.arm).fk(self.joint_positions)

    def object_pose(self, name: str) -> np.ndarray:
        """An object's position [m] and quaternion (x, y, z, w), (7,)."""
        body = self._data.body(name)
        return np.concatenate([body.xpos, body.xquat[[1, 2, 3, 0]]])

    def scene_geometry(self) -> list[Shape]:
        """The world around the robot as shapes to draw, as of the last reset."""
        return world_shapes(self._model, self._data, self._robot.bodies, self.objects)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start an episode. ``options={"state": {name: (x, y, yaw)}}`` places objects by hand."""
        super().reset(seed=seed)
        start = self._nominal_start
        start[-len(self.start) :] += self.np_random.uniform(-self._start_range, self._start_range, len(self.start))
        placement = self._draw(self.np_random)
        chosen = (options or {}).get("state", {})
        for name, where in chosen.items():
            if name not in placement:
                raise UnknownNameError("object", name, placement)
            x, y, yaw = where
            placement[name] = (float(x), float(y), float(yaw))
        mujoco.mj_resetData(self._model, self._data)
        self._robot.place(self._data, start, 1.0)
        self._place(placement)
        mujoco.mj_forward(self._model, self._data)
        self._steps = self._success_steps = 0
        self._quaternion = self._rotation.encode(self.ee_pose[None, :3, :3])[0]
        return self._observe(), {"is_success": False, "failure": ""}

    def step(self, action: np.ndarray) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Servo towards joint targets for one control period."""
        command = np.clip(np.asarray(action, dtype=np.float64), self.action_space.low, self.action_space.high)
        self._robot.command(self._data, command[:-1], command[-1])
        mujoco.mj_step(self._model, self._data, nstep=self._substeps)
        mujoco.mj_forward(self._model, self._data)  # poses and contacts at the new positions
        self._steps += 1
        failure = self._fails()
        if (
            not failure
            and contact_force(self._model, self._data, self._robot.bodies, self._obstacles) > COLLISION_FORCE
        ):
            failure = self._collision()
        self._success_steps = self._success_steps + 1 if not failure and self._succeeds() else 0
        success = self._success_steps >= SUCCESS_STEPS
        done = success or bool(failure)
        if not done and self._steps >= self.max_steps:
            failure = self._times_out()
        return self._observe(), float(success), done, False, {"is_success": success, "failure": failure}

    def leader(self, seed: int) -> Iterator[np.ndarray]:
        """Demonstrate the episode just reset.

        Yields the leader's joint angles [rad] and gripper opening, (n+1,) float64 each control
        period: the action to record and to step with.

        Raises:
            er_il.support.errors.PlanError: no collision-free motion exists; known before the first yield.
        """
        script, speed = self._script(np.random.default_rng([seed, _LEADER]))
        return self._leader_arm.perform(self.joint_positions, script, speed)

    @cached_property
    def _leader_arm(self) -> Leader:
        return Leader(self.arm, 1 / RATE)

    def render(self) -> np.ndarray | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """A picture (H, W, 3) uint8 of the scene for people."""
        return self._cameras.picture(self._data) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Free the rendering contexts."""
        self._cameras.close()

    def _observe(self) -> dict[str, Any]:
        T_base_ee = self.ee_pose
        # The quaternion keeps the sign of the step before: no jump in what a policy reads.
        quaternion = Rotation.from_matrix(T_base_ee[:3, :3]).as_quat()
        self._quaternion = quaternion if quaternion @ self._quaternion >= 0 else -quaternion
        agent = [self.joint_positions, [self.gripper_opening], T_base_ee[:3, 3], self._quaternion]
        observation: dict[str, Any] = {
            "agent_pos": np.concatenate(agent).astype(np.float32),
            "environment_state": np.concatenate([self.object_pose(name) for name in self.objects]).astype(np.float32),
        }
        if self._cameras.names:
            observation["pixels"] = self._cameras.images(self._data)
        return observation

    def _make_observation_space(self, image_size: int) -> gym.spaces.Dict:
        def unbounded(size: int) -> gym.spaces.Box:
            return gym.spaces.Box(-np.inf, np.inf, (size,), np.float32)

        spaces: dict[str, gym.Space[Any]] = {
            "agent_pos": unbounded(len(self.state_names)),
            "environment_state": unbounded(len(self.environment_state_names)),
        }
        if self._cameras.names:
            image = gym.spaces.Box(0, 255, (image_size, image_size, 3), np.uint8)
            spaces["pixels"] = gym.spaces.Dict(dict.fromkeys(self._cameras.names, image))
        return gym.spaces.Dict(spaces)
