"""The base of the paper's reinforcement-learning tasks (section V-A): things, goals and attached grasps.

Contact stops the arm, but ends nothing unless a task says so. The thing that a task is about cuts an episode short when
it falls off the bench; an end of value 0 would teach to stay away from it. Other things may fall. Places are those
before a Panda; before a taller arm everything stands ``shoulder_offset`` higher.
"""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from er_il.support.errors import UnknownNameError
from sim_tasks.tasks.arm_task import ArmTask
from sim_tasks.tasks.placement import Placement
from sim_tasks.tasks.rewards import closeness
from sim_tasks.world.attachment import Attachment, add_attachments, is_open
from sim_tasks.world.contact import touching
from sim_tasks.world.grip import slow_grip
from sim_tasks.world.props import BOX, SPHERE
from sim_tasks.world.robot import TIP, smooth_links
from sim_tasks.world.scene import BENCH_CENTRE, BENCH_SIZE

WIDTH = 0.25  # [m] of the reward's middle kernel over distances; the paper's only one is 1 m wide
TURN_WIDTH = 0.5  # [rad] of that over every angle
PALM = 0.1  # [m] behind the fingertips: a second point of the hand, to tell how it is turned
TIMESTEP = 0.004  # [s] of physics
FALLEN, FELL = 0.1, "fell"  # [m] below the bench's top at which a thing has fallen off it
ATTACHED, FRICTION = "attached", "friction"
GRIPS = (ATTACHED, FRICTION)

UPRIGHT = (1.0, 0.0, 0.0, 0.0)  # quaternion (w, x, y, z)


class ObjectTask(ArmTask):
    """Take, carry and place things, or bring the arm to goals; for what subclasses define see :class:`ArmTask`.

    ``objects`` lists everything that differs between episodes, as free bodies (things) or mocap bodies (goals, and
    furniture that moves), in the order of ``environment_state``.
    """

    obstacles = ()
    start = (0.0, 0.0, 0.0, -2.0, 0.0, 2.0, np.pi / 4)  # the hand points down, in front of the base
    graspable: ClassVar[tuple[str, ...]] = ()  # free bodies that can be taken

    def __init__(self, *, grip: str = ATTACHED, **kwargs: Any) -> None:
        """Build the task.

        Args:
            grip: ``attached``, as in RLBench: the fingers are told to be open or closed, and what both touch when they
                close is welded to the hand until they open; ``friction``: nothing is.
            kwargs: See :class:`ArmTask`.

        Raises:
            UnknownNameError: no such grip.
        """
        if grip not in GRIPS:
            raise UnknownNameError("grip", grip, GRIPS)
        self._attaches = grip == ATTACHED
        self.commanded_opening = 1.0  # in [0, 1], as the last action has it
        super().__init__(**kwargs)
        self._attachment = Attachment(self.model, self.graspable if self._attaches else (), self._fingers)
        self._tip = self.model.body(TIP).id
        self._ids = {name: self.model.body(name).id for name in self.objects}
        mujoco.mj_forward(self.model, self.data)  # what is named can be measured before the first episode, too

    def world_spec(self) -> mujoco.MjSpec:
        spec = super().world_spec()
        spec.option.timestep = TIMESTEP
        slow_grip(spec, self.graspable)
        smooth_links(spec, self.arm)
        if self.shoulder_offset > 0:
            (x, y), (length, width), height = BENCH_CENTRE, BENCH_SIZE, self.shoulder_offset
            # Beside the base, which stands on the bench itself.
            spec.worldbody.add_geom(
                name="riser",
                type=BOX,
                size=((length - 0.4) / 2, width / 2, height / 2),
                pos=(x + 0.2, y, height / 2 - 0.001),
                material="bench",
            )
        if self._attaches:
            add_attachments(spec, self.graspable)
        return spec

    @property
    def touched(self) -> tuple[str, ...]:
        return self.graspable

    @property
    def needed(self) -> tuple[str, ...]:
        """Of the things that can be taken those without which the task cannot be done."""
        return self.graspable

    @property
    def tip(self) -> Vector:
        """The point between the fingertips in the base frame (3,) [m]."""
        return self.data.xpos[self._tip]

    @property
    def tip_rotation(self) -> np.ndarray:
        """Orientation of the hand in the base frame (3, 3), its z axis along the fingers."""
        return self.data.xmat[self._tip].reshape(3, 3)

    @property
    def held(self) -> str:
        """The thing that the hand holds; "" if it holds nothing."""
        if self._attaches:
            return self._attachment.held
        return next((name for name in self.graspable if self._gripped(name)), "")

    @property
    def grasped(self) -> bool:
        """True if the hand holds a thing."""
        return bool(self.held)

    @property
    @abstractmethod
    def ways(self) -> Mapping[str, Vector]:
        """What the reward depends on, as :class:`er_il.envs.protocol.DirectedEnv` tells it."""

    @property
    def directions(self) -> Mapping[str, Vector]:
        return {}

    def position(self, name: str) -> Vector:
        """Origin of an object in the base frame (3,) [m]."""
        return self.data.xpos[self._ids[name]]

    def rotation(self, name: str) -> np.ndarray:
        """Orientation of an object in the base frame (3, 3)."""
        return self.data.xmat[self._ids[name]].reshape(3, 3)

    def point(self, name: str, offset: Sequence[float]) -> Vector:
        """A point of an object in the base frame (3,) [m], given in the object's frame."""
        return self.position(name) + self.rotation(name) @ np.asarray(offset)

    def _reach(self, point: Vector) -> float:
        """Closeness in (0, 1] of the fingertips to a point (3,) [m]."""
        return closeness(float(np.linalg.norm(self.tip - point)), WIDTH)

    def _reach_down(self, point: Vector) -> float:
        """Closeness in (0, 1] to a hand that is at a point (3,) [m] with its fingers down.

        By the mean of two distances: of the fingertips to the point, and of the palm to the place above it.
        """
        palm = self.tip - PALM * self.tip_rotation[:, 2]
        away = np.linalg.norm(self.tip - point) + np.linalg.norm(palm - point - (0.0, 0.0, PALM))
        return closeness(float(away) / 2, WIDTH)

    def _put(self, name: str, position: Sequence[float], quaternion: Sequence[float] = UPRIGHT) -> None:
        """Put an object of an episode that begins: position [m] before a Panda, quaternion (w, x, y, z)."""
        x, y, z = position
        raised = (x, y, z + self.shoulder_offset)
        mocap = int(self.model.body(name).mocapid[0])
        if mocap >= 0:
            self.data.mocap_pos[mocap], self.data.mocap_quat[mocap] = raised, quaternion
        else:
            self.data.joint(name).qpos = (*raised, *quaternion)

    def _place(self, placement: Placement) -> None:
        self.commanded_opening = 1.0
        self._attachment.forget()
        self._arrange(placement)

    @abstractmethod
    def _arrange(self, placement: Placement) -> None:
        """Put the objects at a placement by :meth:`_put`; forget the last episode."""

    def _drive(self, command: Vector) -> None:
        self.commanded_opening = float(command[-1])
        opening = float(is_open(self.commanded_opening)) if self._attaches else self.commanded_opening
        super()._drive(np.append(command[:-1], opening))

    def _grip(self, opening: float) -> None:
        self._attachment.update(self.data, opening)

    def _gripped(self, name: str) -> bool:
        return all(touching(self.model, self.data, finger, {self._ids[name]}) for finger in self._fingers)

    def _fails(self) -> str:
        return ""

    def _cut_short(self) -> str:
        lowest = self.shoulder_offset - FALLEN
        return FELL if any(self.position(name)[2] < lowest for name in self.needed) else super()._cut_short()

    def _times_out(self) -> str:
        return "timeout"


def add_goal(spec: mujoco.MjSpec, name: str, radius: float, rgba: Sequence[float]) -> mujoco.MjsBody:
    """Add a ball that marks a place: a mocap body that touches nothing."""
    body = spec.worldbody.add_body(name=name, mocap=True)
    body.add_geom(type=SPHERE, size=(radius, 0, 0), rgba=rgba, contype=0, conaffinity=0, group=2)
    return body
