"""A small fridge with glass sides and a door that closes by itself."""

from dataclasses import dataclass

import mujoco

from sim_tasks.world.props import BOX, CYLINDER

ENAMEL, LINING, CHROME = (0.93, 0.94, 0.95, 1.0), (0.80, 0.89, 0.95, 1.0), (0.62, 0.64, 0.67, 1.0)
SEEN = {"mass": 0, "contype": 0, "conaffinity": 0, "group": 2}  # shapes that are only to be seen


@dataclass(frozen=True)
class Fridge:
    """A fridge whose front faces the robot (-x); the door's hinge is at its left edge (+y), seen from the robot."""

    front: float = 0.58  # x of the opening
    side: float = 0.315  # y of the middle
    depth: float = 0.32
    inner_width: float = 0.38
    floor: float = 0.14  # z of the compartment's floor
    ceiling: float = 0.60
    wall: float = 0.02
    door: float = 0.03  # thickness
    opening: float = 1.9  # [rad] of the door at its stop
    stiffness: float = 3.0  # [Nm/rad] of the spring that closes it
    preload: float = 0.3  # [rad] by which the spring is wound up when the door is shut
    damping: float = 3.0  # [Nms/rad] it cannot be flung open
    mass: float = 1.2  # [kg] of the door

    @property
    def _middle(self) -> float:
        return (self.floor + self.ceiling) / 2

    @property
    def _half_height(self) -> float:
        return (self.ceiling - self.floor) / 2

    def add(self, spec: mujoco.MjSpec, name: str, door: str) -> None:
        """Add the fridge, fixed to the world, and on it the door, a body with a hinge of its name; 0 is shut."""
        body = spec.worldbody.add_body(name=name, pos=(0, self.side, 0))
        half_depth, half_width, t = self.depth / 2, self.inner_width / 2 + self.wall, self.wall / 2
        x, middle, half_height = self.front + half_depth, self._middle, self._half_height
        boards = (
            ((half_depth, half_width, self.floor / 2), (x, 0, self.floor / 2), ENAMEL),
            ((half_depth, half_width, t), (x, 0, self.ceiling + t), ENAMEL),
        )
        for size, position, rgba in boards:
            body.add_geom(type=BOX, size=size, pos=position, rgba=rgba)
        panes = (
            ((half_depth, t, half_height), (x, half_width - t, middle)),
            ((half_depth, t, half_height), (x, t - half_width, middle)),
            ((t, half_width - self.wall, half_height), (self.front + self.depth - t, 0, middle)),
        )
        for size, position in panes:
            body.add_geom(type=BOX, size=size, pos=position, material="glass")
        self._add_looks(body, half_width)
        self._add_door(body, door, half_width)

    def _add_looks(self, body: mujoco.MjsBody, half_width: float) -> None:
        """The lining of floor and ceiling, posts at the corners, and below a drawer with its handle."""
        x, middle, half_height = self.front + self.depth / 2, self._middle, self._half_height
        lining = (self.depth / 2 - 0.005, self.inner_width / 2, 0.001)
        for z in (self.floor, self.ceiling):
            body.add_geom(type=BOX, size=lining, pos=(x, 0, z), rgba=LINING, **SEEN)
        for post_x in (self.front + 0.008, self.front + self.depth - 0.008):
            for side in (-1, 1):
                post = (post_x, side * (half_width - 0.01), middle)
                body.add_geom(type=BOX, size=(0.009, 0.0105, half_height), pos=post, rgba=ENAMEL, **SEEN)
        drawer = (0.004, half_width - 0.015, self.floor / 2 - 0.03)
        body.add_geom(type=BOX, size=drawer, pos=(self.front - 0.002, 0, self.floor / 2), rgba=LINING, **SEEN)
        handle = (0.01, 0.08, 0.006)
        body.add_geom(type=BOX, size=handle, pos=(self.front - 0.014, 0, self.floor - 0.06), rgba=CHROME, **SEEN)

    def _add_door(self, fridge: mujoco.MjsBody, name: str, half_width: float) -> None:
        body = fridge.add_body(name=name, pos=(self.front, half_width, self._middle), gravcomp=1)
        body.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=(0, 0, -1),
            range=(0, self.opening),
            limited=True,
            stiffness=self.stiffness,
            springref=-self.preload,
            damping=self.damping,
        )
        half, y, half_height = self.door / 2, -half_width, self._half_height + self.wall
        # Smooth by its priority, whatever touches it: the arm slides along it.
        body.add_geom(
            type=BOX,
            size=(half, half_width, half_height),
            pos=(-half - 0.002, y, 0),
            rgba=ENAMEL,
            mass=self.mass,
            friction=(0.1, 0.005, 0.0001),
            priority=1,
        )
        inside = (0.002, half_width - 0.02, half_height - 0.03)
        body.add_geom(type=BOX, size=inside, pos=(-0.001, y, 0), rgba=LINING, **SEEN)
        edge = 0.05 - 2 * half_width  # y of the handle
        grip = (0.008, 0.09, 0)
        body.add_geom(type=CYLINDER, size=grip, pos=(-self.door - 0.03, edge, 0), rgba=CHROME, **SEEN)
        for z in (-0.08, 0.08):
            foot = (0.015, 0.006, 0.006)
            body.add_geom(type=BOX, size=foot, pos=(-self.door - 0.017, edge, z), rgba=CHROME, **SEEN)
