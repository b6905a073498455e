"""An open display cupboard that can be turned."""

from dataclasses import dataclass

import mujoco

from sim_tasks.world.props import BOX, CYLINDER

SEEN = {"contype": 0, "conaffinity": 0, "group": 2}


@dataclass(frozen=True)
class Cupboard:
    """A compartment with glass walls, open at the front (-x), on a closed base. Lengths and heights [m]."""

    depth: float = 0.18
    inner_width: float = 0.36
    floor: float = 0.56  # height of the compartment's floor
    ceiling: float = 0.74
    wall: float = 0.012

    def add(self, spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
        """Add the cupboard as a mocap body whose origin is its middle, on the ground."""
        body = spec.worldbody.add_body(name=name, mocap=True)
        x, y, t = self.depth / 2, self.inner_width / 2 + self.wall, self.wall / 2
        middle, half = (self.floor + self.ceiling) / 2, (self.ceiling - self.floor) / 2
        boards = (
            ((x, y, self.floor / 2), (0, 0, self.floor / 2), "wood"),
            ((x, y, t), (0, 0, self.ceiling + t), "wood"),
            ((x, t, half), (0, y - t, middle), "glass"),
            ((x, t, half), (0, t - y, middle), "glass"),
            ((t, y - 2 * t, half), (x - t, 0, middle), "glass"),
        )
        for size, position, material in boards:
            body.add_geom(type=BOX, size=size, pos=position, material=material)
        self._add_looks(body)
        return body

    def _add_looks(self, body: mujoco.MjsBody) -> None:
        x, y, board = self.depth / 2, self.inner_width / 2 + self.wall, 0.004
        drawer = self.floor / 2 - 0.02
        for level in (0.25, 0.75):  # two drawers with knobs
            size, place = (board, y - 0.015, drawer / 2 - 0.004), (-x, 0, 0.01 + level * 2 * drawer)
            body.add_geom(type=BOX, size=size, pos=place, material="dark_wood", **SEEN)
            knob = (-x - 0.012, 0, place[2])
            body.add_geom(
                type=CYLINDER,
                size=(0.011, 0.008, 0),
                pos=knob,
                quat=(0.5**0.5, 0, 0.5**0.5, 0),
                material="steel",
                **SEEN,
            )
        post = (0.007, 0.007, (self.ceiling - self.floor) / 2)
        for end in (-1, 1):
            for side in (-1, 1):
                place = (end * (x - 0.006), side * (y - 0.006), self.floor + post[2])
                body.add_geom(type=BOX, size=post, pos=place, material="dark_wood", **SEEN)
