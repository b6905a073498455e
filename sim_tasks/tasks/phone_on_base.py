"""Phone on Base: put a cordless phone's handset into the cradle of its base station (paper V-A)."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.object_task import WIDTH
from sim_tasks.tasks.placement import Placement, yawed
from sim_tasks.tasks.release_task import ReleaseTask
from sim_tasks.tasks.rewards import Reward, closeness, way_down
from sim_tasks.world.phone import HANDSET, BaseStation
from sim_tasks.world.randomisation import sides, span

PHONE, BASE = "phone", "base"
GRIP = (0.0, 0.0, 0.020)  # [m] where the fingers take the handset, in its frame
NEAR, TILT = 0.02, np.radians(15)  # [m], [rad] from its place within which the handset is on the base
CORNERS = 0.2 * np.array([(1.0, 0.0, 0.0), (-0.5, 0.866, 0.0), (-0.5, -0.866, 0.0)])  # [m] in its frame, around it


class PhoneOnBase(ReleaseTask):
    """The handset in the cradle and out of the hand."""

    task = "phone_on_base"
    task_description = "Put the phone on its base."
    objects = (PHONE, BASE)
    graspable = (PHONE,)
    station = BaseStation()
    centre, base_place = (0.45, -0.13), (0.50, 0.22)  # x, y [m] of the middles of their places
    reward = Reward(reach=0.0625, place=0.25, open=0.25, success=0.4375)

    def __init__(
        self,
        *,
        phone_range: tuple[float, float] = (0.20, 0.25),
        phone_yaw_range: float = 0.7854,
        base_range: tuple[float, float] = (0.10, 0.10),
        base_yaw_range: float = 0.5,
        **kwargs: Any,
    ) -> None:
        """Build the task.

        Args:
            phone_range: Sides [m] of the rectangle in which the handset lies.
            phone_yaw_range: The handset is turned up to this far [rad].
            base_range: Sides [m] of the rectangle in which the base station stands.
            base_yaw_range: The base station is turned up to this far [rad].
            kwargs: See :class:`sim_tasks.tasks.object_task.ObjectTask`.
        """
        self._phone_range = sides("phone_range", phone_range)
        self._phone_yaw_range = span("phone_yaw_range", phone_yaw_range)
        self._base_range = sides("base_range", base_range)
        self._base_yaw_range = span("base_yaw_range", base_yaw_range)
        self._rest_position, self._rest_rotation = self.station.rest
        super().__init__(**kwargs)

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.station.add(spec, BASE)
        HANDSET.add(spec, PHONE, (*self.centre, 0.0))

    def _draw(self, rng: np.random.Generator) -> Placement:
        placement: Placement = {}
        for name, centre, area, turn in (
            (PHONE, self.centre, self._phone_range, self._phone_yaw_range),
            (BASE, self.base_place, self._base_range, self._base_yaw_range),
        ):
            x, y = np.array(centre) + (rng.random(2) - 0.5) * area
            placement[name] = (x, y, rng.uniform(-turn, turn))
        return placement

    def _arrange(self, placement: Placement) -> None:
        for name, (x, y, yaw) in placement.items():
            self._put(name, (x, y, 0.0), yawed(yaw))

    @property
    def rest(self) -> np.ndarray:
        """The handset's place in the cradle: its pose (4, 4) in the base frame."""
        T = np.eye(4)
        T[:3, :3] = self.rotation(BASE) @ self._rest_rotation
        T[:3, 3] = self.point(BASE, self._rest_position.tolist())
        return T

    def _in_place(self) -> bool:
        rest, rotation = self.rest, self.rotation(PHONE)
        turn = np.arccos(np.clip((np.sum(rest[:3, :3] * rotation) - 1) / 2, -1.0, 1.0))
        return bool(np.linalg.norm(self.position(PHONE) - rest[:3, 3]) < NEAR and turn < TILT)

    @property
    def ways(self) -> Mapping[str, Vector]:
        corners = {f"corner_{number}": left for number, left in enumerate(self._corners_left(), 1)}
        return {PHONE: self.point(PHONE, GRIP) - self.tip} | corners

    @property
    def directions(self) -> Mapping[str, Vector]:
        return {PHONE: self.rotation(PHONE)[:, 0], BASE: self.rotation(BASE)[:, 0]}

    def _corners_left(self) -> np.ndarray:
        """How far the corners (3, 3) [m] of a triangle around the handset are from where they are in the cradle."""
        rest = self.rest
        return rest[:3, 3] + CORNERS @ rest[:3, :3].T - (self.position(PHONE) + CORNERS @ self.rotation(PHONE).T)

    def _left(self) -> float:
        """Mean way [m] of these corners: to be moved and to be turned."""
        return float(np.mean([way_down(left) for left in self._corners_left()]))

    def _progress(self) -> dict[str, float]:
        if self._in_place():
            return {"reach": 1.0, "place": 1.0, "open": self.commanded_opening if self.grasped else 1.0}
        if self.grasped:
            return {"reach": 1.0, "place": closeness(self._left(), WIDTH), "open": 0.0}
        return {
            "reach": self._reach(self.point(PHONE, GRIP)),
            "place": 0.0,
            "open": 0.0,
        }
