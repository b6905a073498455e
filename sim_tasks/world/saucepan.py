"""A saucepan with a long handle, and its lid."""

from dataclasses import dataclass

import mujoco

from sim_tasks.world.household import Primitive, Rgba, Thing
from sim_tasks.world.props import BOX, CAPSULE, CYLINDER

ENAMEL, SOUP, LID_STEEL = (0.72, 0.12, 0.10, 1.0), (0.90, 0.52, 0.16, 1.0), (0.55, 0.57, 0.60, 1.0)
RIM_STEEL, BAKELITE = (0.38, 0.40, 0.43, 1.0), (0.07, 0.07, 0.08, 1.0)

LID_THICKNESS = 0.008  # [m]
KNOB_RADIUS, KNOB_HEIGHT = 0.017, 0.024  # [m]
KNOB_MIDDLE = 0.032  # [m] of the knob above the lid's underside


@dataclass(frozen=True)
class Saucepan:
    """A pan full of soup, closed for contact: its lid stands on it, and nothing can fall into it."""

    radius: float = 0.085  # [m]
    height: float = 0.085  # [m] of the rim
    handle: float = 0.15  # [m] length
    enamel: Rgba = ENAMEL

    @property
    def lid(self) -> Thing:
        """Its lid, whose knob fits between the fingers."""
        radius, half = self.radius + 0.002, LID_THICKNESS / 2
        knob = Primitive(CYLINDER, (KNOB_RADIUS, KNOB_HEIGHT / 2, 0.0), (0.0, 0.0, KNOB_MIDDLE), BAKELITE)
        stem = (KNOB_MIDDLE - LID_THICKNESS) / 2
        return Thing(
            mass=0.25,
            looks=(
                Primitive(CYLINDER, (radius, half / 2, 0.0), (0.0, 0.0, half / 2), RIM_STEEL),
                Primitive(CYLINDER, (radius - 0.006, half, 0.0), (0.0, 0.0, half), LID_STEEL),
                Primitive(CYLINDER, (0.45 * radius, half, 0.0), (0.0, 0.0, half + 0.002), LID_STEEL),
                Primitive(CYLINDER, (0.009, stem, 0.0), (0.0, 0.0, LID_THICKNESS + stem), RIM_STEEL),
                knob,
            ),
            touch=(
                (Primitive(CYLINDER, (radius, half, 0.0), (0.0, 0.0, half)), 0.9),
                (knob, 0.1),
            ),
            grip=knob,
        )

    def add(self, spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
        """Add the pan as a mocap body whose origin is the middle of its underside; the handle points along x."""
        body = spec.worldbody.add_body(name=name, mocap=True)
        r, half = self.radius, self.height / 2
        seen = {"contype": 0, "conaffinity": 0, "group": 2}
        body.add_geom(name=f"{name}_pot", type=CYLINDER, size=(r, half, 0), pos=(0, 0, half), rgba=self.enamel)
        for part, radius, colour in (("rim", r, RIM_STEEL), ("soup", r - 0.006, SOUP)):
            top = self.height + (0.0005 if part == "soup" else 0.0)
            size, position = (radius + 0.001, 0.002, 0), (0, 0, top - 0.002)
            body.add_geom(name=f"{name}_{part}", type=CYLINDER, size=size, pos=position, rgba=colour, **seen)
        z, neck = 0.7 * self.height, 0.03
        body.add_geom(
            name=f"{name}_neck",
            type=BOX,
            size=(neck / 2, 0.008, 0.005),
            pos=(r + neck / 2, 0, z),
            rgba=RIM_STEEL,
            **seen,
        )
        body.add_geom(
            name=f"{name}_handle",
            type=CAPSULE,
            size=(0.011, 0, 0),
            fromto=(r + neck, 0, z, r + self.handle, 0, z),
            rgba=BAKELITE,
        )
        return body
