"""A waste bin with a bag in it."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco

from sim_tasks.world.household import Rgba
from sim_tasks.world.props import BOX

BAG: Rgba = (0.88, 0.90, 0.92, 1.0)


@dataclass(frozen=True)
class Bin:
    """A square bin, open at the top; its frame's origin is the middle of the underside, z up."""

    width: float = 0.20  # [m] inside
    height: float = 0.17  # [m] of the rim
    wall: float = 0.006  # [m]

    def contains(self, point: Sequence[float], below: float = 0.0) -> bool:
        """True if a point [m] in the bin's frame is inside, at least ``below`` [m] below the rim."""
        x, y, z = point
        half = self.width / 2
        return abs(x) < half and abs(y) < half and 0.0 < z < self.height - below

    def add(self, spec: mujoco.MjSpec, name: str, material: str) -> mujoco.MjsBody:
        """Add the bin as a mocap body, which can be put anywhere."""
        body = spec.worldbody.add_body(name=name, mocap=True)
        half, t = self.width / 2, self.wall / 2
        outer, middle = half + 2 * t, self.height / 2
        body.add_geom(type=BOX, size=(outer, outer, t), pos=(0, 0, t), material=material)
        # The bag lines the walls and is folded over the rim.
        fold, overhang = 0.03, 0.0025  # [m] height of the fold, and by how much it stands out
        seen = {"rgba": BAG, "mass": 0, "contype": 0, "conaffinity": 0, "group": 2}
        for side in (1, -1):
            for x, y, along in ((half + t, 0.0, 1), (0.0, half + t, 0)):
                size = [t, t, middle]
                size[along] = outer
                position = (side * x, side * y, middle)
                body.add_geom(type=BOX, size=size, pos=position, material=material)
                for axis in range(2):
                    size[axis] += overhang
                size[2] = fold / 2
                body.add_geom(type=BOX, size=size, pos=(*position[:2], self.height - fold / 2 + overhang), **seen)
                size = [0.001, 0.001, middle - 2 * t]
                size[along] = half
                inside = (side * (half - 0.001) * (along == 1), side * (half - 0.001) * (along == 0), middle)
                body.add_geom(type=BOX, size=size, pos=inside, **seen)
        return body
