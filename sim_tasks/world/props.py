"""Things in the worlds: each function adds one to a spec, sized in metres, standing at its frame's origin."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

BOX, CYLINDER, MESH, SPHERE, CAPSULE = (
    mujoco.mjtGeom.mjGEOM_BOX,
    mujoco.mjtGeom.mjGEOM_CYLINDER,
    mujoco.mjtGeom.mjGEOM_MESH,
    mujoco.mjtGeom.mjGEOM_SPHERE,
    mujoco.mjtGeom.mjGEOM_CAPSULE,
)


@dataclass(frozen=True)
class Goblet:
    """A cup on a thin stem. Heights [m] above the surface it stands on."""

    foot_radius: float = 0.036
    foot_height: float = 0.006
    stem_radius: float = 0.005
    stem_top: float = 0.140
    bowl_radius: float = 0.034
    height: float = 0.200
    mass: float = 0.12  # [kg]

    def add(self, spec: mujoco.MjSpec, name: str, position: Sequence[float], material: str) -> mujoco.MjsBody:
        """Add the cup as a free body whose origin is the middle of its foot's underside."""
        body = spec.worldbody.add_body(name=name, pos=position)
        body.add_freejoint(name=name)
        mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
        vertices, faces = _lathe(self._profile())
        mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel()
        body.add_geom(type=MESH, meshname=name, material=material, contype=0, conaffinity=0, mass=0, group=2)
        stem = (self.stem_top - self.foot_height) / 2
        bowl = (self.height - self.stem_top) / 2
        # Most of the mass sits in the foot, as in a real stemmed cup: it stands by itself.
        shapes = (
            (self.foot_radius, self.foot_height / 2, self.foot_height / 2, 0.6),
            (self.stem_radius, stem, self.foot_height + stem, 0.1),
            (self.bowl_radius, bowl, self.stem_top + bowl, 0.3),
        )
        for radius, half_height, centre, share in shapes:
            body.add_geom(
                type=CYLINDER,
                size=(radius, half_height, 0),
                pos=(0, 0, centre),
                mass=share * self.mass,
                friction=(1.0, 0.02, 0.0005),
                condim=4,
                group=3,
            )
        return body

    def _profile(self) -> np.ndarray:
        """(K, 2) radius and height along the outline, from the foot up, over the rim and down inside."""
        foot = [(0, 0), (self.foot_radius, 0), (self.foot_radius, self.foot_height * 0.6)]
        flare = [(self.foot_radius * 0.45, self.foot_height), (self.stem_radius, self.foot_height * 3)]
        neck = [(self.stem_radius, self.stem_top - 0.012), (self.stem_radius * 2, self.stem_top)]
        t = np.linspace(0, np.pi / 2, 9)[1:]
        depth = self.height - self.stem_top
        outer = [(self.bowl_radius * np.sin(a), self.stem_top + depth * (1 - np.cos(a))) for a in t if np.sin(a) > 0.35]
        wall = 0.0025
        inner = [(max(r - wall, 0.0), z + wall * (z < self.height)) for r, z in reversed(outer)]
        return np.array([*foot, *flare, *neck, *outer, *inner, (0, self.stem_top + wall)])


@dataclass(frozen=True)
class Cabinet:
    """A cupboard with one open compartment; its front faces the robot (-x)."""

    front: float = 0.42  # x of the opening
    depth: float = 0.40
    inner_width: float = 0.34
    floor: float = 0.50  # z of the compartment's floor
    ceiling: float = 0.76
    wall: float = 0.018

    def raised(self, offset: float) -> "Cabinet":
        """The cabinet with its compartment ``offset`` [m] higher."""
        return replace(self, floor=self.floor + offset, ceiling=self.ceiling + offset)

    def add(self, spec: mujoco.MjSpec, name: str, material: str, inside: str, sides: str) -> mujoco.MjsBody:
        """Add the cabinet, fixed to the world; its back has the ``inside`` material."""
        body = spec.worldbody.add_body(name=name)
        half_depth, half_width, t = self.depth / 2, self.inner_width / 2 + self.wall, self.wall / 2
        x = self.front + half_depth
        middle, half_height = (self.floor + self.ceiling) / 2, (self.ceiling - self.floor) / 2
        boards = {
            "base": ((half_depth, half_width, self.floor / 2 - t), (x, 0, self.floor / 2 - t), material),
            "floor": ((half_depth, half_width, t), (x, 0, self.floor - t), material),
            "ceiling": ((half_depth, half_width, t), (x, 0, self.ceiling + t), material),
            "left": ((half_depth, t, half_height), (x, half_width - t, middle), sides),
            "right": ((half_depth, t, half_height), (x, -half_width + t, middle), sides),
            "back": ((t, half_width - 2 * t, half_height), (x + half_depth - t, 0, middle), inside),
        }
        for board, (size, position, look) in boards.items():
            body.add_geom(name=f"{name}_{board}", type=BOX, size=size, pos=position, material=look)
        return body


@dataclass(frozen=True)
class Wall:
    """An upright panel across the robot's back."""

    x: float = -0.20  # of its face
    width: float = 0.7
    height: float = 0.95
    thickness: float = 0.02

    def raised(self, offset: float) -> "Wall":
        """The wall, ``offset`` [m] higher."""
        return replace(self, height=self.height + offset)

    def add(self, spec: mujoco.MjSpec, name: str, material: str) -> mujoco.MjsBody:
        """Add the wall, fixed to the world."""
        body = spec.worldbody.add_body(name=name)
        size = (self.thickness / 2, self.width / 2, self.height / 2)
        centre = (self.x - self.thickness / 2, 0, self.height / 2)
        body.add_geom(name=name, type=BOX, size=size, pos=centre, material=material)
        return body


@dataclass(frozen=True)
class Stand:
    """A table on one column."""

    centre: tuple[float, float] = (0.62, 0.0)
    height: float = 0.50
    size: tuple[float, float] = (0.24, 0.30)

    def raised(self, offset: float) -> "Stand":
        """The stand with its top ``offset`` [m] higher."""
        return replace(self, height=self.height + offset)

    def add(self, spec: mujoco.MjSpec, name: str, material: str) -> mujoco.MjsBody:
        """Add the stand, fixed to the world."""
        body = spec.worldbody.add_body(name=name, pos=(*self.centre, 0.0))
        t = 0.01
        top = (self.size[0] / 2, self.size[1] / 2, t)
        column = (0.03, self.height / 2 - t, 0)
        body.add_geom(name=f"{name}_top", type=BOX, size=top, pos=(0, 0, self.height - t), material=material)
        body.add_geom(name=f"{name}_column", type=CYLINDER, size=column, pos=(0, 0, column[1]), material=material)
        return body


@dataclass(frozen=True)
class PushButton:
    """A mushroom push button on a pedestal. Heights [m] above what the pedestal stands on."""

    height: float = 0.29  # of the pedestal's top
    radius: float = 0.05  # of the cap
    dome: float = 0.025  # height of the cap
    travel: float = 0.06  # down to its stop
    stiffness: float = 200.0  # [N/m] of the spring under it
    mass: float = 0.05  # [kg] of the cap

    def raised(self, offset: float) -> "PushButton":
        """The button on a pedestal that is ``offset`` [m] higher."""
        return replace(self, height=self.height + offset)

    @property
    def rest(self) -> float:
        """Height of the cap's underside while nobody presses."""
        return self.height + self.travel + 0.005  # a gap at the stop: the cap never touches the pedestal

    def add(self, spec: mujoco.MjSpec, name: str, pedestal: str, material: str, base: str) -> None:
        """Add a pedestal that can be put anywhere (a mocap body), and on it the cap, which slides along its z."""
        stand = spec.worldbody.add_body(name=pedestal, mocap=True)
        housing = 0.05  # height of the collar at the pedestal's top
        parts = (("foot", 0.07, 0.0, 0.01, "steel"), ("column", 0.02, 0.01, self.height - housing, "steel"))
        parts += (("housing", 0.9 * self.radius, self.height - housing, self.height, base),)
        for part, radius, low, high, look in parts:
            size, position = (radius, (high - low) / 2, 0), (0, 0, (low + high) / 2)
            stand.add_geom(name=f"{pedestal}_{part}", type=CYLINDER, size=size, pos=position, material=look)
        cap = stand.add_body(name=name, pos=(0, 0, self.rest), gravcomp=1)
        # Damped critically: it springs back at once, and does not swing.
        damping = 2 * (self.stiffness * self.mass) ** 0.5
        cap.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=(0, 0, 1),
            range=(-self.travel, 0),
            limited=True,
            stiffness=self.stiffness,
            damping=damping,
        )
        mesh = spec.add_mesh(name=name)
        t = np.linspace(0, np.pi / 2, 10)
        vertices, faces = _lathe(np.array([(0, 0), *zip(self.radius * np.cos(t), self.dome * np.sin(t), strict=True)]))
        mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel()
        # Smooth plastic (by its priority, whatever touches it): what comes from aside slides up on it and presses.
        cap.add_geom(
            name=f"{name}_cap",
            type=MESH,
            meshname=name,
            material=material,
            mass=self.mass,
            friction=(0.2, 0.005, 0.0001),
            priority=1,
        )
        shaft = (self.rest - self.height) / 2
        cap.add_geom(
            name=f"{name}_shaft",
            type=CYLINDER,
            size=(0.35 * self.radius, shaft, 0),
            pos=(0, 0, -shaft),
            material="steel",
            mass=0,
            contype=0,
            conaffinity=0,
        )


def _lathe(profile: np.ndarray, segments: int = 36) -> tuple[np.ndarray, np.ndarray]:
    """Turn an outline (K, 2) of radius and height into a surface: vertices (V, 3), faces (F, 3)."""
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.concatenate([np.column_stack([radius * ring, np.full(segments, z)]) for radius, z in profile])
    faces = []
    for k in range(len(profile) - 1):
        for i in range(segments):
            a, b = k * segments + i, k * segments + (i + 1) % segments
            faces += [(a, b, a + segments), (b, b + segments, a + segments)]
    return vertices, np.array(faces)
