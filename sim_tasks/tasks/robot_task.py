"""The base of every task: a robot in a MuJoCo world, commanded in joint positions, episodes judged and rewarded."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar

import gymnasium as gym
import mujoco
import numpy as np

from er_il.arms.arm import Vector
from er_il.support.episode_end import Step, after_the_end
from er_il.support.errors import NotResetError, UnknownNameError
from er_il.support.shapes import Shape
from sim_tasks.tasks.observation import Observer, object_pose
from sim_tasks.tasks.placement import Area, Placement, read_options
from sim_tasks.tasks.registration import Demonstrator, leader_class, registration
from sim_tasks.tasks.rewards import Reward, total
from sim_tasks.tasks.targets import JointTargets
from sim_tasks.world.camera import PICTURE, Cameras
from sim_tasks.world.contact import contact_force
from sim_tasks.world.geometry import world_shapes
from sim_tasks.world.randomisation import span
from sim_tasks.world.scene import BENCH_CENTRE, BENCH_SIZE

RATE, RATES = 20, (10, 20)  # [Hz] of control: the usual one, and those that a world can be made for
COLLISION_FORCE = 20.0  # [N] at which a Panda's collision reflex stops it, by its makers' default
SUCCESS_TIME = 0.25  # [s] for which success must hold


class RobotTask(gym.Env[dict[str, Any], np.ndarray], ABC):
    """A task for a robot. Subclasses bring the robot: one arm (:class:`ArmTask`) or two (:class:`BimanualTask`).

    Their subclasses build the world, place its objects, judge episodes and give rewards.

    Action, and ``agent_pos`` in the observation: as the robot's class says. ``environment_state``: position [m] and
    quaternion (x, y, z, w) of each object; ``pixels``: a (size, size, 3) uint8 image a camera,
    if cameras are asked for.
    Reward: the sum, in [0, 1], of the terms in ``info["reward_terms"]``; 1 if the goal holds.
    Every ``info`` has ``is_success`` and ``failure`` (empty while there is none) besides. Success and failure
    terminate an episode; at the step limit it is truncated, and ``failure`` names the reason. From then on the world
    goes on, as a real one does, but the verdict stands, and there is no reward, until the next reset.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array"], "render_fps": RATE}  # pyrefly: ignore[bad-override]

    task: ClassVar[str]  # name under which the class is registered
    task_description: ClassVar[str]
    objects: ClassVar[tuple[str, ...]]  # bodies that move, in the order of environment_state
    obstacles: ClassVar[tuple[str, ...]]  # bodies that the robot must not run into
    area: ClassVar[Area] = Area.around(BENCH_CENTRE, BENCH_SIZE)  # on which objects may be placed by hand
    reward: ClassVar[Reward]

    observer: Observer
    targets: JointTargets
    bodies: frozenset[int]  # ids of the robot's

    def __init__(
        self,
        *,
        cameras: Sequence[str] = (),
        image_size: int = 96,
        render_mode: str | None = None,
        visualization_width: int = PICTURE[1],
        visualization_height: int = PICTURE[0],
        arm: str,
        rate: int = RATE,
        max_steps: int | None = None,
        start_range: float = 0.02,
        **leader_settings: Any,
    ) -> None:
        """Build the world.

        Args:
            cameras: Cameras to observe; none by default, which needs no GL.
            image_size: Side [px] of their square images.
            render_mode: ``rgb_array`` for :meth:`render`.
            visualization_width: Width [px] of the pictures of :meth:`render`.
            visualization_height: Height [px] of these.
            arm: Name of the robot, follower and leader.
            rate: Control rate [Hz].
            max_steps: Steps after which an episode is truncated; an equal time at every rate if omitted.
            start_range: Each of the joints that ``start`` names starts up to this far [rad] from the start posture.
            leader_settings: Keyword arguments of the task's leader.

        Raises:
            UnknownNameError: no such camera, render mode, or arm for this task.
            RandomisationError: a range is invalid.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise UnknownNameError("render mode", render_mode, self.metadata["render_modes"])
        self._choose(arm)
        if rate not in RATES:
            raise UnknownNameError("control rate", rate, map(str, RATES))
        self.rate = rate
        self.metadata = {**self.metadata, "render_fps": rate}  # pyrefly: ignore[read-only]
        self.max_steps = max_steps or registration(self.task).max_steps * rate // RATE
        self.render_mode = render_mode
        self._start_range = span("start_range", start_range)
        self.model = self.world_spec().compile()
        self.data = mujoco.MjData(self.model)
        self._obstacles = {self.model.body(name).id for name in self.obstacles}
        self._substeps = round(1 / rate / self.model.opt.timestep)
        self._success_steps_needed = math.ceil(SUCCESS_TIME * rate)
        self._cameras = Cameras(self.model, cameras, image_size, (visualization_height, visualization_width))
        self._connect()
        self._steps = self._success_steps = 0
        self.action_space = self.targets.space
        self._last: Step | None = None  # the episode's last step, its end once it has ended; None before any reset
        self._beyond_success = False
        self.observation_space = self.observer.space()
        self._leader_settings = leader_settings
        if leader_settings:
            self._leader  # noqa: B018  wrong settings are refused now, not at the first demonstration

    @abstractmethod
    def _choose(self, name: str) -> None:
        """Take the robot of that name.

        Raises:
            UnknownNameError: the task has none of that name.
        """

    @abstractmethod
    def world_spec(self) -> mujoco.MjSpec:
        """The whole world: robot and surroundings with the task's objects."""

    @abstractmethod
    def _connect(self) -> None:
        """Find the robot in the compiled world; set ``observer``, ``targets`` and ``bodies``."""

    @abstractmethod
    def _draw_start(self, rng: np.random.Generator) -> Vector:
        """Draw the joint angles [rad] at which an episode starts."""

    @abstractmethod
    def _rest(self, q: Vector) -> None:
        """Put the robot at rest at joint angles [rad], the grippers open."""

    @abstractmethod
    def _drive(self, command: Vector) -> None:
        """Give the servos their targets."""

    def _driven(self, command: Vector) -> None:
        """What a command does besides, once the robot has moved by a control period."""

    @abstractmethod
    def _build(self, spec: mujoco.MjSpec) -> None:
        """Add the task's furniture and objects to the scene."""

    @abstractmethod
    def _draw(self, rng: np.random.Generator) -> Placement:
        """Draw a random placement of the objects."""

    @abstractmethod
    def _place(self, placement: Placement) -> None:
        """Put the objects at a placement; forget the last episode."""

    @abstractmethod
    def _succeeds(self) -> bool:
        """True if the goal holds in this state."""

    @abstractmethod
    def _fails(self) -> str:
        """Name of an irreversible failure, empty if there is none."""

    def _collision(self) -> str:
        """Name of the failure if the robot collides with an obstacle in this state."""
        return "collision"

    def _cut_short(self) -> str:
        """Name of the failure if the episode is to be truncated in this state, empty if it goes on."""
        return self._times_out() if self._steps >= self.max_steps else ""

    @abstractmethod
    def _times_out(self) -> str:
        """Name of the failure if the step limit is reached in this state."""

    @abstractmethod
    def _progress(self) -> dict[str, float]:
        """Progress in [0, 1] of each stage of ``reward`` but success, a function of the state; 1 once complete."""

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of ``agent_pos``."""
        return self.observer.state_names

    @property
    def environment_state_names(self) -> tuple[str, ...]:
        """Names of ``environment_state``."""
        return self.observer.environment_state_names

    @property
    @abstractmethod
    def joint_positions(self) -> Vector:
        """The follower's true joint angles [rad]."""

    def object_pose(self, name: str) -> np.ndarray:
        """An object's position [m] and quaternion (x, y, z, w) in the base frame, (7,)."""
        return object_pose(self.data, name)

    def scene_geometry(self) -> list[Shape]:
        """The world around the robot as shapes to draw, as of the last reset."""
        return world_shapes(self.model, self.data, self.bodies, self.objects)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: Seed of the initial state.
            options: ``state``, a pose (x, y, yaw) by object, places these by hand, anywhere in the task's ``area``;
                ``beyond_success=True`` lets success be no end: the episode is judged on, to record all of it.

        Raises:
            ValueError: an option or object is unknown, or a pose is none; the world stays as it is.
        """
        chosen, self._beyond_success = read_options(options, self.objects, self.area)
        super().reset(seed=seed)
        start = self._draw_start(self.np_random)
        placement = self._draw(self.np_random) | chosen
        mujoco.mj_resetData(self.model, self.data)
        self._rest(start)
        self._place(placement)
        mujoco.mj_forward(self.model, self.data)
        self._steps = self._success_steps = 0
        terms = self.reward.terms(self._progress(), success=False)
        observation, info = self.observer.reset(self.data), {"is_success": False, "failure": "", "reward_terms": terms}
        self._last = observation, 0.0, False, False, info
        return observation, info

    def step(self, action: np.ndarray) -> Step:
        """Servo towards joint targets for one control period; beyond the Box, up to 2 pi, they are clipped.

        Raises:
            ValueError: what came is no action (not finite, of another shape or type, farther beyond the Box), or no
                episode was started. The world stays as it is.
        """
        command = self.targets.checked(action)
        if self._last is None:
            raise NotResetError
        _, _, terminated, truncated, info = self._last
        step = self._advance(command)
        if truncated or (terminated and not (info["is_success"] and self._beyond_success)):
            return after_the_end(self._last, step[0])
        self._last = step
        return step

    def _advance(self, command: Vector) -> Step:
        """Move the world on by one control period, and judge it."""
        self._drive(command)
        mujoco.mj_step(self.model, self.data, nstep=self._substeps)
        mujoco.mj_forward(self.model, self.data)  # poses and contacts at the new positions
        self._driven(command)
        self._steps += 1
        failure = self._fails()
        if not failure and self._collides():
            failure = self._collision()
        goal = not failure and self._succeeds()
        self._success_steps = self._success_steps + 1 if goal else 0
        success = self._success_steps >= self._success_steps_needed
        terminated = success or bool(failure)
        cut = "" if terminated else self._cut_short()
        terms = self.reward.terms(self._progress(), goal)
        info = {"is_success": success, "failure": failure or cut, "reward_terms": terms}
        return self.observer.observe(self.data), total(terms), terminated, bool(cut), info

    def _collides(self) -> bool:
        if not self._obstacles:
            return False
        return contact_force(self.model, self.data, self.bodies, self._obstacles) > COLLISION_FORCE

    def leader(self, seed: int) -> Iterator[np.ndarray]:
        """Demonstrate the episode just reset.

        Yields the leader's joint angles [rad] and gripper opening, (n+1,) float64 each control
        period: the action to record and to step with.

        Raises:
            sim_tasks.tasks.registration.NoLeaderError: the task has none.
            er_il.support.errors.PlanError: no collision-free motion was found; known before the first yield.
        """
        return self._leader.demonstrate(seed)

    @cached_property
    def _leader(self) -> Demonstrator:
        return leader_class(self.task)(self, **self._leader_settings)

    def render(self) -> np.ndarray | None:
        """A picture (H, W, 3) uint8 of the scene for people."""
        return self._cameras.picture(self.data) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Free the rendering contexts."""
        self._cameras.close()
