"""A wine rack: two bottles lie in its lower row, and one place above them is free."""

from dataclasses import dataclass

import mujoco
import numpy as np

from sim_tasks.world.props import BOX, MESH
from sim_tasks.world.tableware import BOTTLE_RADIUS, bottle

RED_GLASS, WAX = (0.30, 0.05, 0.09, 1.0), (0.80, 0.68, 0.30, 1.0)

SEAT = 0.095  # [m] from a bottle's foot, of the point of its axis that lies over the rack's middle
_NECK_RADIUS = 0.012  # [m] of the bottle


@dataclass(frozen=True)
class WineRack:
    """Two scalloped boards, body in the one, neck in the other; frame: the middle of the underside, x to the necks."""

    height: float = 0.125  # of the axis of the bottle in the free place
    lower: float = 0.042  # of those in the lower row
    apart: float = 0.090  # between these
    half_width: float = 0.085
    boards: tuple[float, float] = (0.030, 0.195)  # from a bottle's foot, where the boards hold it
    half_board: float = 0.007

    def add(self, spec: mujoco.MjSpec, name: str, material: str, rail: str) -> mujoco.MjsBody:
        """Add the rack as a mocap body."""
        body = spec.worldbody.add_body(name=name, mocap=True)
        seen = {"mass": 0, "contype": 0, "conaffinity": 0, "group": 2}
        radii = (BOTTLE_RADIUS, _NECK_RADIUS)
        for part, along, radius in zip(("body", "neck"), self.boards, radii, strict=True):
            self._add_board(spec, f"{name}_{part}", radius + 0.0015)
            body.add_geom(type=MESH, meshname=f"{name}_{part}", pos=(along - SEAT, 0, 0), material=material, **seen)
            self._add_cradle(body, along - SEAT, radius)
        middle, half = sum(self.boards) / 2 - SEAT, (self.boards[1] - self.boards[0]) / 2
        for y in (self.half_width - 0.01, 0.01 - self.half_width):
            body.add_geom(type=BOX, size=(half, 0.008, 0.006), pos=(middle, y, 0.016), material=rail, **seen)
        # One simple shape for all of the lower row.
        top = (self.lower + BOTTLE_RADIUS) / 2
        block = (half + self.half_board, self.half_width, top)
        body.add_geom(type=BOX, size=block, pos=(middle, 0, top), group=3)
        for y in (-self.apart / 2, self.apart / 2):
            lying = body.add_body(pos=(-SEAT, y, self.lower), quat=(np.sqrt(0.5), 0, np.sqrt(0.5), 0))
            for shape in bottle(RED_GLASS, WAX).looks:
                lying.add_geom(type=shape.kind, size=shape.size, pos=shape.centre, rgba=shape.rgba, **seen)
        return body

    def _add_cradle(self, body: mujoco.MjsBody, x: float, radius: float) -> None:
        """A groove of two sloping boxes, which touch a round thing at 45 degrees on both sides."""
        half = (self.half_board, 0.6 * radius + 0.006, 0.004)
        for side in (-1, 1):
            slope = np.pi / 4 * side
            # Half the thickness below the tangent, and a little outwards along it.
            across = np.array([np.cos(slope), np.sin(slope)])
            down = np.array([np.sin(slope), -np.cos(slope)])
            y, z = (radius + half[2]) * down + 0.004 * side * across
            quat = (np.cos(slope / 2), np.sin(slope / 2), 0, 0)
            body.add_geom(
                type=BOX, size=half, pos=(x, y, self.height + z), quat=quat, friction=(0.6, 0.02, 0.0005), group=3
            )

    def _add_board(self, spec: mujoco.MjSpec, name: str, radius: float) -> None:
        """The look of a board: its top scalloped by a half circle around the axis of the free place."""
        angles = np.linspace(np.pi, 0, 17)
        arc = np.column_stack([radius * np.cos(angles), self.height - radius * np.sin(angles)])
        # From the left: the top outline, and below it the straight bottom, as a strip of quadrilaterals.
        top = np.vstack([(-self.half_width, self.height), arc, (self.half_width, self.height)])
        bottom = np.column_stack([top[:, 0], np.zeros(len(top))])
        outline = np.vstack([top, bottom])
        count, n = len(outline), len(top)
        vertices = np.vstack(
            [np.column_stack([np.full(count, x), outline]) for x in (-self.half_board, self.half_board)]
        )
        faces = []
        for i in range(n - 1):
            a, b, c, d = i, i + 1, n + i, n + i + 1
            faces += [(a, b, c), (b, d, c)]  # seen from behind
            faces += [(count + a, count + c, count + b), (count + b, count + c, count + d)]  # from the front
            faces += [(a, count + a, b), (b, count + a, count + b)]  # the top
            faces += [(c, d, count + c), (d, count + d, count + c)]  # the bottom
        for a, c in ((0, n), (n - 1, 2 * n - 1)):  # the ends
            quad = [(a, c, count + a), (c, count + c, count + a)]
            faces += quad if a == 0 else [face[::-1] for face in quad]
        mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
        mesh.uservert, mesh.userface = vertices.ravel(), np.array(faces).ravel()
