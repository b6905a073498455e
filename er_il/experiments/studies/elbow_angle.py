"""The study of the arm angle: where self-motion leaves the elbow where it is, and what a policy's errors do there.

Any angle of the elbow, whatever its reference, changes along self-motion only as the elbow moves. Where the elbow
stands still (on a Panda: the upper arm upright, so that joints 1 and 3 turn it about one axis), the angle says nothing
about the joints. Errors of the size that policies make are added to demonstrations' actions, which are decoded one
after the other, once by the space alone, and once by the commander of an arm that follows exactly.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from er_il.arms.arm import Arm, Vector
from er_il.control.commander import Commander
from er_il.experiments.studies import Advance, Demos
from er_il.kinematics.self_motion import self_motions
from er_il.kinematics.solver import Kinematics
from er_il.spaces.base import Array
from er_il.spaces.pose import PoseSpace
from er_il.spaces.registry import ERA, ERA_STEREO, ERJ, make_arm_space
from er_il.spaces.round_trip import SINGULAR
from er_il.support.errors import ArmError
from er_il.support.workers import run_jobs

SPACES = (ERJ, ERA, ERA_STEREO)
PERIOD = 0.05  # [s] of control
POSITION_ERROR, ROTATION_ERROR, VALUE_ERROR = 2e-3, 6e-3, 1e-2  # [m, rad, rad] standard deviations at each step

Step = Callable[[Vector, Vector], Vector]  # an action (dim,) and joints (n,) [rad] to the next joints


def study_elbow_angle(arm: Arm, demos: Demos, workers: int, advance: Advance) -> dict[str, Any]:
    """Measure ERJ, and ERA with both references, along sets of demonstrations.

    Returns:
        JSON with a row of ``elbow_angles`` per set and space: the share of frames near a singularity of the space
        (``near_singular``) and of those in which self-motion moves the elbow by less than as many metres per radian
        (``elbow_still``), and for ``decoded`` and ``commanded`` the median and the 99th percentile of the largest
        distance of the ``joints`` [rad], the ``hand`` and the ``elbow`` [m] from the demonstrations.

    Raises:
        ArmError: the arm has no arm angle.
    """
    frames = arm.angle_frames
    if frames is None or arm.redundancy != 1:
        raise ArmError(f"{arm.name} has no arm angle: that takes seven joints with a shoulder, an elbow and a wrist.")
    paths = {name: [path.commanded for path in of_set] for name, of_set in demos.items()}
    jobs = [(_measured, arm, frames.elbow, space, name, of_set) for name, of_set in paths.items() for space in SPACES]
    return {"elbow_angles": run_jobs(jobs, workers, advance)}


def elbow_speed(kinematics: Kinematics, elbow: str, q: Array) -> Vector:
    """How far (N,) [m/rad] a link moves per radian of self-motion at q (N, n) [rad], n = 7."""
    (self_motion,) = self_motions(kinematics.arm, q).transpose(1, 0, 2)  # (N, n) unit
    jacobian = kinematics.chain.walk(q).jacobian(kinematics.mounted(elbow))[:3]  # (3, n, N)
    return np.linalg.norm(np.einsum("inN,Nn->Ni", jacobian, self_motion), axis=1)


def _measured(arm: Arm, elbow: str, name: str, of_set: str, demos: Sequence[Array]) -> dict[str, Any]:
    space, q = make_arm_space(name, arm), np.concatenate(demos)
    assert isinstance(space, PoseSpace)
    still = elbow_speed(space.kinematics, elbow, q) < SINGULAR
    near = space.conditionings(q) < SINGULAR
    found: dict[str, Any] = {"demos": of_set, "space": name, "frames": len(q)}
    found |= {"near_singular": float(near.mean()), "elbow_still": float(still.mean())}
    for way, make in (("decoded", _decoder), ("commanded", _commander)):
        played = [_played(space, demo, make(space, demo[0]), np.random.default_rng(i)) for i, demo in enumerate(demos)]
        found[way] = _distances(space.kinematics, elbow, np.concatenate(played), q)
    return found


def _decoder(space: PoseSpace, start: Vector) -> Step:
    return lambda action, q: space.decode(action, q).q


def _commander(space: PoseSpace, start: Vector) -> Step:
    commander = Commander(space, PERIOD)
    commander.reset(start)
    return lambda action, q: commander.command(action, q).q


def _played(space: PoseSpace, demo: Array, step: Step, rng: np.random.Generator) -> Array:
    """The joints (T, n) [rad] that a demonstration's actions lead to, with errors."""
    T_base_ee, q, played = space.kinematics.fk_batch(demo), demo[0], []
    count = len(demo)
    T_base_ee[:, :3, 3] += rng.normal(scale=POSITION_ERROR, size=(count, 3))
    turns = Rotation.from_rotvec(rng.normal(scale=ROTATION_ERROR, size=(count, 3)))
    T_base_ee[:, :3, :3] = turns.as_matrix() @ T_base_ee[:, :3, :3]
    values = space.redundancy_along(demo) + rng.normal(scale=VALUE_ERROR, size=(count, 1))
    for action in np.column_stack([T_base_ee[:, :3, 3], space.rotation.encode(T_base_ee[:, :3, :3]), values]):
        q = step(action, q)
        played.append(q)
    return np.array(played)


def _distances(kinematics: Kinematics, elbow: str, played: Array, meant: Array) -> dict[str, list[float]]:
    """Median and 99th percentile of the distances between two sequences of joints (N, n) [rad]."""
    ways = {"hand": None, "elbow": elbow}
    far = {
        name: np.linalg.norm(
            kinematics.fk_batch(played, link)[:, :3, 3] - kinematics.fk_batch(meant, link)[:, :3, 3], axis=1
        )
        for name, link in ways.items()
    }
    far["joints"] = np.abs(played - meant).max(axis=1)
    return {name: np.percentile(each, [50, 99]).tolist() for name, each in far.items()}
