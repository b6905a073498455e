"""An arm with the Panda's hand in MuJoCo, built from the same URDF that the kinematics read."""

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np

from er_il.arms.arm import Arm
from er_il.arms.urdf import find_mesh, parse_urdf
from er_il.kinematics.solver import kinematics_of

SHOULDER = "panda_link1"  # the link that turns the upper arm; the tasks are measured from a Panda's
HAND, TIP = "panda_hand", "panda_hand_tcp"  # the hand, and the point between its fingertips
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
FINGER_BODIES = ("panda_leftfinger", "panda_rightfinger")
SMOOTH = (0.1, 0.005, 0.0001)  # friction of painted covers
FINGER_TRAVEL = 0.04  # [m] each finger, from closed to open
GRIPPER = "gripper"  # actuator name

# Stiffness [Nm/rad] of joints whose torque limit [Nm] is above; critically damped, the servo lags by
# some 20 ms, so that the hand follows within 5 mm at demo speed.
STIFFNESS = ((200.0, 36000.0), (50.0, 12000.0), (0.0, 6000.0))
ARMATURE = 0.1  # [kg m^2] reflected rotor inertia
HARD_STOP = (0.004, 1.0)  # [s] time constant, damping ratio of the joints' limits: two time steps of 2 ms
HARD = (0.99, 0.999, 0.001, 0.5, 2.0)  # their impedance: no contact pushes a joint out of its range
FINGER_KP, FINGER_KV, FINGER_FORCE = 1000.0, 40.0, 35.0  # [N/m], [Ns/m], [N]

# Convex hulls of neighbouring links overlap by design, not by collision.
OVERLAPPING = (
    ("panda_link5", "panda_link7"),
    ("panda_link5", "panda_hand"),
    ("panda_link6", "panda_hand"),
    ("panda_link7", "panda_hand"),
)

WHITE, GREY, BLACK = (0.93, 0.94, 0.95, 1.0), (0.55, 0.57, 0.6, 1.0), (0.12, 0.12, 0.13, 1.0)
COLOURS = {"panda_link5": WHITE, "panda_link6": WHITE, "panda_link7": GREY, "panda_hand": GREY}


@dataclass(frozen=True)
class RobotModel:
    """Addresses of the robot's joints and actuators in a compiled model."""

    joint_qpos: np.ndarray  # (n,) addresses in qpos
    joint_dofs: np.ndarray  # (n,) addresses in qvel
    finger_qpos: np.ndarray  # (2,)
    actuators: np.ndarray  # (n,) ids
    gripper: int  # actuator id
    bodies: frozenset[int]

    @classmethod
    def of(
        cls,
        model: mujoco.MjModel,
        arm: Arm,
        root: str | None = None,
        fingers: tuple[str, str] = FINGERS,
        gripper: str = GRIPPER,
    ) -> "RobotModel":
        """Look the robot up in a compiled model; ``root``: its lowest body, the arm's base if omitted."""
        lowest = model.body(root or arm.base_frame).id
        return cls(
            joint_qpos=np.array([model.joint(joint).qposadr[0] for joint in arm.joints]),
            joint_dofs=np.array([model.joint(joint).dofadr[0] for joint in arm.joints]),
            finger_qpos=np.array([model.joint(finger).qposadr[0] for finger in fingers]),
            actuators=np.array([model.actuator(joint).id for joint in arm.joints]),
            gripper=model.actuator(gripper).id,
            bodies=frozenset(b for b in range(model.nbody) if descends(model, b, lowest)),
        )

    def place(self, data: mujoco.MjData, q: np.ndarray, opening: float) -> None:
        """Put the arm at rest at q (n,) [rad], the servos holding it there."""
        data.qpos[self.joint_qpos] = q
        data.qpos[self.finger_qpos] = opening * FINGER_TRAVEL
        self.command(data, q, opening)

    def command(self, data: mujoco.MjData, q: np.ndarray, opening: float) -> None:
        """Set the servo targets: joint angles (n,) [rad] and the gripper's opening in [0, 1]."""
        data.ctrl[self.actuators] = q
        data.ctrl[self.gripper] = opening * FINGER_TRAVEL

    def joint_positions(self, data: mujoco.MjData) -> np.ndarray:
        """Measured joint angles (n,) [rad], a copy."""
        return data.qpos[self.joint_qpos]

    def opening(self, data: mujoco.MjData) -> float:
        """Measured opening of the gripper in [0, 1]."""
        left, right = data.qpos[self.finger_qpos].tolist()
        return (left + right) / 2 / FINGER_TRAVEL


def robot_spec(arm: Arm) -> mujoco.MjSpec:
    """Build the robot: collision meshes of its URDF, position servos, gravity compensation."""
    spec = mujoco.MjSpec.from_string(_mujoco_urdf(arm))
    set_physics(spec)
    for body in spec.bodies[1:]:
        body.gravcomp = 1
        for geom in body.geoms:
            finger = "finger" in body.name
            geom.rgba = BLACK if finger else COLOURS.get(body.name, WHITE)
            if finger:
                geom.friction = (1.2, 0.02, 0.0005)  # rubber tips
                geom.condim = 4
    for joint in arm.joints:
        add_servo(spec, joint)
    add_gripper(spec, GRIPPER, FINGERS)
    # MuJoCo lets a link pass through the one that carries it, except where that one is fixed to the world.
    lowest = spec.joint(arm.joints[0]).parent
    for one, other in ((lowest.parent.name, lowest.name), *OVERLAPPING):
        spec.add_exclude(bodyname1=one, bodyname2=other)
    return spec


def smooth_links(spec: mujoco.MjSpec, arm: Arm) -> None:
    """Let the arm slide along furniture, all but its fingers.

    By MuJoCo's friction of 1 it sticks to what it leans on, held by the hundreds of newtons of its servos: a posture
    that keeps still whatever noise is added to the commands, in which learning agents come to rest.
    """
    lowest = spec.joint(arm.joints[0]).parent
    for body in (lowest, *lowest.find_all("body")):
        if body.name not in FINGER_BODIES:
            for geom in body.geoms:
                geom.friction, geom.priority = SMOOTH, 1


def set_physics(spec: mujoco.MjSpec) -> None:
    """Choose how a world with a robot is integrated, and its friction."""
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.timestep = 0.002
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10


def add_servo(spec: mujoco.MjSpec, name: str) -> None:
    """Give a joint a position servo as strong as its actuator force range [Nm], and hard stops."""
    joint = spec.joint(name)
    joint.armature = ARMATURE
    joint.solref_limit, joint.solimp_limit = HARD_STOP, HARD
    torque = float(joint.actfrcrange[1])
    servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    servo.set_to_position(kp=next(kp for above, kp in STIFFNESS if torque > above), dampratio=1.0)
    servo.forcerange = (-torque, torque)
    servo.ctrlrange = joint.range


def add_gripper(spec: mujoco.MjSpec, name: str, fingers: tuple[str, str]) -> None:
    """Drive two finger joints [m] by one actuator."""
    one, other = fingers
    gripper = spec.add_actuator(name=name, target=one, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    gripper.set_to_position(kp=FINGER_KP, kv=FINGER_KV)
    gripper.forcerange = (-FINGER_FORCE, FINGER_FORCE)
    gripper.ctrlrange = (0, FINGER_TRAVEL)
    coupling = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=other, name2=one)
    coupling.data[:2] = (0.0, 1.0)


def shoulder_offset(arm: Arm) -> float:
    """Height [m] of an arm's shoulder above that of the Panda, both at home."""

    def height(which: Arm) -> float:
        return float(kinematics_of(which).frame_pose(which.home, SHOULDER)[2, 3])

    return round(height(arm) - height(Arm.preset("panda")), 6)


@lru_cache
def _mujoco_urdf(arm: Arm) -> str:
    """The URDF as MuJoCo's parser wants it: collision shapes only, meshes found by file name."""
    root = parse_urdf(arm.urdf)
    folder = ""
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
        for mesh in link.iter("mesh"):
            folder = str(find_mesh(mesh.get("filename", ""), arm.urdf).parent)
    for joint in root.findall("joint"):
        for tag in ("safety_controller", "mimic"):  # unknown to MuJoCo, and replaced by the equality
            for element in joint.findall(tag):
                joint.remove(element)
    ET.SubElement(
        ET.SubElement(root, "mujoco"),
        "compiler",
        meshdir=folder,
        fusestatic="false",
        strippath="true",
        balanceinertia="true",
        discardvisual="false",  # else materials and the tasks' visual shapes are dropped too
    )
    return ET.tostring(root, encoding="unicode")


def descends(model: mujoco.MjModel, body: int, root: int) -> bool:
    """True if a body is another one, or is carried by it."""
    while body and body != root:
        body = int(model.body_parentid[body])
    return body == root
