"""Serve Coffee Obstacles: carry a mug over bottles to a plate, the forearm between two plants (paper V-A).

The plants stand before the robot, as high as the forearm. While the hand crosses the counter the forearm turns in the
gap between them: the elbow has to swing to the other side than the hand, or the forearm sweeps a plant.
"""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.object_task import TURN_WIDTH, WIDTH, ObjectTask
from sim_tasks.tasks.placement import Area, Placement, yawed
from sim_tasks.tasks.rewards import Reward, closeness
from sim_tasks.world.contact import touching
from sim_tasks.world.crockery import Plate, mug
from sim_tasks.world.fixed import add_fixed
from sim_tasks.world.household import Sideboard
from sim_tasks.world.plants import tall_plant
from sim_tasks.world.randomisation import sides, span
from sim_tasks.world.tableware import bottle

MUG, PLATE, COUNTER = "mug", "plate", "counter"
TOP = 0.25  # z [m] of the counter
BOTTLES = {"bottle0": (0.50, -0.06), "bottle1": (0.57, 0.0), "bottle2": (0.50, 0.06)}  # x, y [m]
PLANTS = {"plant0": (0.20, -0.18), "plant1": (0.20, 0.28)}  # on the bench
GRASP = (0.0, 0.0, 0.068)  # [m] of the mug, where the fingers find it
WAYPOINT = (0.50, 0.12, TOP + 0.29)  # [m] of the mug: past the bottles, above their tops
UPRIGHT_TILT = 0.5  # [rad] up to which a carried mug is upright
STANDS = np.cos(np.radians(15))  # of the tilt of a mug that stands
ON_PLATE = 0.035  # [m] between the axes of mug and plate, at most


class ServeCoffeeObstacles(ObjectTask):
    """The mug upright on the plate, nothing touched on the way."""

    task = "serve_coffee_obstacles"
    task_description = "Serve the coffee: put the mug on the plate without touching the bottles and plants."
    furniture = Sideboard(front=0.30, depth=0.38, width=0.84, height=TOP)
    plate = Plate()
    objects = (MUG, PLATE)
    graspable = (MUG,)
    area = Area((0.30, 0.68), (-0.42, 0.42))
    start = (-1.64, -0.28, 1.17, -1.63, -0.04, 1.38, -0.28)  # above the mug, 9 cm clear of what is fragile
    centres = ((0.50, -0.24), (0.51, 0.225))  # x, y [m] of the middles of the places of mug and plate
    reward = Reward(reach=0.0625, upright=0.0625, waypoint=0.25, serve=0.25, success=0.375)

    def __init__(
        self,
        *,
        mug_range: tuple[float, float] = (0.06, 0.04),
        mug_yaw_range: float = 0.44,
        plate_range: tuple[float, float] = (0.06, 0.03),
        **kwargs: Any,
    ) -> None:
        """Build the task.

        Args:
            mug_range: Sides [m] of the rectangle in which the mug stands.
            mug_yaw_range: The handle points up to this far [rad] to either side of straight away from the robot.
            plate_range: Sides [m] of the rectangle in which the plate lies.
            kwargs: See :class:`ObjectTask`.
        """
        self._ranges = sides("mug_range", mug_range), sides("plate_range", plate_range)
        self._mug_yaw_range = span("mug_yaw_range", mug_yaw_range)
        super().__init__(**kwargs)
        self._carrying = self.robot.bodies | {self.model.body(MUG).id}
        self._fragile = {self.model.body(name).id for name in (*BOTTLES, *PLANTS)}

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.furniture.add(spec, COUNTER, "wood", "dark_wood")
        for name, place in BOTTLES.items():
            add_fixed(spec, bottle(), name, (*place, TOP))
        for name, place in PLANTS.items():
            add_fixed(spec, tall_plant(), name, (*place, 0.0))
        self.plate.add(spec, PLATE)
        mug().add(spec, MUG, (*self.centres[0], TOP))

    def _draw(self, rng: np.random.Generator) -> Placement:
        placement: Placement = {}
        for name, centre, size in zip(self.objects, self.centres, self._ranges, strict=True):
            x, y = np.array(centre) + (rng.random(2) - 0.5) * size
            yaw = rng.uniform(-self._mug_yaw_range, self._mug_yaw_range) if name == MUG else 0.0
            placement[name] = (x, y, yaw)
        return placement

    def _arrange(self, placement: Placement) -> None:
        for name, (x, y, yaw) in placement.items():
            self._put(name, (x, y, TOP + (0.0005 if name == MUG else 0.0)), yawed(yaw))

    @property
    def grasp_point(self) -> Vector:
        """Where the tip of the hand takes the mug (3,) [m]."""
        return self.point(MUG, GRASP)

    @property
    def ways(self) -> Mapping[str, Vector]:
        return {
            MUG: self.grasp_point - self.tip,
            "waypoint": WAYPOINT - self.position(MUG),
            PLATE: self._to_plate(),
        }

    @property
    def directions(self) -> Mapping[str, Vector]:
        return {"mug_up": self.rotation(MUG)[:, 2], "mug_handle": self.rotation(MUG)[:, 0]}

    def _to_plate(self) -> Vector:
        """From the mug to where it stands on the plate (3,) [m]."""
        return self.point(PLATE, (0.0, 0.0, self.plate.height)) - self.position(MUG)

    def _succeeds(self) -> bool:
        x, y, z = self._to_plate()
        return bool(self.rotation(MUG)[2, 2] > STANDS and np.hypot(x, y) < ON_PLATE and abs(z) < 0.005)

    def _fails(self) -> str:
        return "collision" if touching(self.model, self.data, self._carrying, self._fragile) else super()._fails()

    def _progress(self) -> dict[str, float]:
        if self._succeeds():
            return {"reach": 1.0, "upright": 1.0, "waypoint": 1.0, "serve": 1.0}
        if not self.grasped:
            reach = self._reach(self.grasp_point)
            return {"reach": reach, "upright": 0.0, "waypoint": 0.0, "serve": 0.0}
        tilt = float(np.arccos(np.clip(self.rotation(MUG)[2, 2], -1.0, 1.0)))
        carried = {"reach": 1.0, "upright": closeness(tilt - UPRIGHT_TILT, TURN_WIDTH)}
        if self.position(MUG)[1] > WAYPOINT[1]:
            return carried | {"waypoint": 1.0, "serve": closeness(float(np.linalg.norm(self._to_plate())), WIDTH)}
        to_waypoint = float(np.linalg.norm(self.position(MUG) - WAYPOINT))
        return carried | {"waypoint": closeness(to_waypoint, WIDTH), "serve": 0.0}
