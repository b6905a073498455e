"""The scene common to all tasks: the robot on its bench, lights, materials and cameras."""

import mujoco

from er_il.arms.arm import Arm
from sim_tasks.world.camera import VIEWS
from sim_tasks.world.props import BOX
from sim_tasks.world.robot import robot_spec, shoulder_offset

BENCH_CENTRE, BENCH_SIZE = (0.4, 0.0), (1.3, 1.1)  # [m] x, y; its sides
FLOOR = -0.75  # [m] below the base

# name: colour, specular, shininess, reflectance
MATERIALS = {
    "wood": ((0.72, 0.53, 0.36, 1.0), 0.15, 0.2, 0.0),
    "dark_wood": ((0.48, 0.33, 0.22, 1.0), 0.1, 0.2, 0.0),
    "bench": ((0.50, 0.53, 0.56, 1.0), 0.1, 0.2, 0.0),
    "glass": ((0.75, 0.88, 0.92, 0.28), 0.6, 0.8, 0.0),
    "plaster": ((0.78, 0.76, 0.72, 1.0), 0.05, 0.1, 0.0),
    "cobalt": ((0.15, 0.45, 0.90, 1.0), 0.5, 0.6, 0.0),  # of a cup, for a small camera to tell it from wood
    "steel": ((0.30, 0.32, 0.35, 1.0), 0.4, 0.5, 0.0),
    "red": ((0.78, 0.08, 0.07, 1.0), 0.5, 0.5, 0.0),
    "yellow": ((0.95, 0.76, 0.10, 1.0), 0.3, 0.4, 0.0),
}


def scene_spec(arm: Arm) -> mujoco.MjSpec:
    """Build the empty scene around a robot; tasks add their things to it."""
    spec = robot_spec(arm)
    add_room(spec)
    world = spec.worldbody
    # The bench stands 1 mm below the robot's base, so that their touching is no collision.
    (x, y), (length, width) = BENCH_CENTRE, BENCH_SIZE
    bench = (length / 2, width / 2, 0.02)
    world.add_geom(name="bench", type=BOX, size=bench, pos=(x, y, -0.021), material="bench")
    for x in (-0.2, 1.0):
        for y in (-0.5, 0.5):
            world.add_geom(
                type=BOX, size=(0.025, 0.025, 0.355), pos=(x, y, -0.395), material="bench", contype=0, conaffinity=0
            )
    for view in VIEWS:
        view.add(spec, shoulder_offset(arm))
    return spec


def add_room(spec: mujoco.MjSpec) -> None:
    """Add what is around every robot: lights, sky, floor, and the materials of things."""
    visual = spec.visual
    visual.headlight.ambient, visual.headlight.diffuse = (0.35, 0.35, 0.35), (0.35, 0.35, 0.35)
    visual.headlight.specular = (0.1, 0.1, 0.1)
    world = spec.worldbody
    world.add_light(pos=(0.3, 0.8, 2.6), dir=(0.1, -0.3, -1.0), diffuse=(0.55, 0.55, 0.52), castshadow=True)
    world.add_light(pos=(-1.0, -1.5, 2.2), dir=(0.5, 0.6, -0.7), diffuse=(0.2, 0.2, 0.24), castshadow=False)
    sky = spec.add_texture(name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, width=64, height=384)
    sky.builtin, sky.rgb1, sky.rgb2 = mujoco.mjtBuiltin.mjBUILTIN_GRADIENT, (0.80, 0.85, 0.90), (0.55, 0.6, 0.66)
    tiles = spec.add_texture(name="tiles", type=mujoco.mjtTexture.mjTEXTURE_2D, width=256, height=256)
    tiles.builtin, tiles.rgb1, tiles.rgb2 = mujoco.mjtBuiltin.mjBUILTIN_CHECKER, (0.62, 0.64, 0.66), (0.57, 0.59, 0.61)
    ground = spec.add_material(name="ground", texrepeat=(10, 10), texuniform=True)
    ground.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    for name, (rgba, specular, shininess, reflectance) in MATERIALS.items():
        spec.add_material(name=name, rgba=rgba, specular=specular, shininess=shininess, reflectance=reflectance)
    world.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(3, 3, 0.1),
        pos=(0, 0, FLOOR),
        material="ground",
        contype=0,
        conaffinity=0,
    )
