"""Inverse kinematics of other libraries: mink, pink, and GeoFIK's closed forms for the Panda.

They are the dependency group ``peers``, and left out where they are not installed. mink and pink take steps as in
their examples, with er_il's weights and damping and without a margin to joint limits; an equality constraint holds the
joint that is commanded. They stop where the task's own error is within the tolerances.
"""

import importlib.metadata
import importlib.util
import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
from solvers import MAX_ITERATIONS, POSITION_TOLERANCE, ROTATION_TOLERANCE, Array, Solution, Solver, Target

from er_il import Arm
from er_il.arms.arm import Vector

PACKAGES = {"mink": "mink", "pink": "pin-pink", "daqp": "daqp", "geofikpy": "geofikpy"}  # modules and distributions
QP = "daqp"
LM_DAMPING = 1e-2  # [1] damping per squared error, as er_il's


class Mink(Solver):
    """mink, on MuJoCo's model of the arm's URDF."""

    name = "mink"

    def __init__(self, arm: Arm, space: str) -> None:
        import mink
        import mujoco

        super().__init__(arm, space)
        self._mink = mink
        self._configuration = mink.Configuration(mujoco.MjModel.from_xml_string(_mujoco_urdf(arm)))
        model = self._configuration.model
        assert [model.joint(i).name for i in range(model.nq)] == list(arm.joints)
        self._task = mink.FrameTask(arm.ee_frame, "body", 1.0, 1.0, lm_damping=LM_DAMPING)
        self._limits = [mink.ConfigurationLimit(model, gain=1.0)]
        held = self.held()
        self._constraints = [mink.DofFreezingTask(model, held)] if held else None

    def solve(self, target: Target, seed: Vector) -> Solution:
        configuration, task = self._configuration, self._task
        configuration.update(self.start(target, seed))
        task.set_target(self._mink.SE3.from_matrix(target.T_base_ee))
        iterations = 0
        while iterations < MAX_ITERATIONS and not _within_tolerance(task.compute_error(configuration)):
            try:
                velocity = self._mink.solve_ik(
                    configuration, [task], 1.0, QP, limits=self._limits, constraints=self._constraints
                )
            except self._mink.NoSolutionFound:
                break
            configuration.integrate_inplace(velocity, 1.0)
            iterations += 1
        return Solution(configuration.q.copy(), iterations)


class Pink(Solver):
    """pink, on Pinocchio's model of the arm's URDF."""

    name = "pink"

    def __init__(self, arm: Arm, space: str) -> None:
        import pink
        from pink.limits import ConfigurationLimit
        from pink.tasks import FrameTask, LinearHolonomicTask

        super().__init__(arm, space)
        self._pink = pink
        self._model = pin.buildModelFromXML(arm.model_xml)
        assert list(self._model.names)[1:] == list(arm.joints)
        self._configuration = pink.Configuration(self._model, self._model.createData(), arm.home)
        self._task = FrameTask(arm.ee_frame, 1.0, 1.0, lm_damping=LM_DAMPING)
        self._limits = [ConfigurationLimit(self._model, 1.0)]
        held = self.held()
        rows = np.eye(arm.dof)[held]
        self._hold = LinearHolonomicTask(rows, np.zeros(len(held)), np.zeros(arm.dof)) if held else None

    def solve(self, target: Target, seed: Vector) -> Solution:
        configuration, task = self._configuration, self._task
        configuration.update(self.start(target, seed))
        task.set_target(pin.SE3(target.T_base_ee))
        if self._hold is not None:
            self._hold.b = target.values
        constraints = None if self._hold is None else [self._hold]
        iterations = 0
        while iterations < MAX_ITERATIONS and not _within_tolerance(task.compute_error(configuration)):
            try:
                velocity = self._pink.solve_ik(
                    configuration, [task], 1.0, QP, limits=self._limits, constraints=constraints, safety_break=False
                )
            except self._pink.exceptions.NoSolutionFound:
                break
            configuration.integrate_inplace(velocity, 1.0)
            iterations += 1
        return Solution(np.array(configuration.q), iterations)


class GeoFik(Solver):
    """GeoFIK's closed form for a pose and the last joint: of its solutions the nearest to the seed."""

    name = "GeoFIK (closed form)"

    def __init__(self, arm: Arm) -> None:
        import geofikpy

        super().__init__(arm, f"erj@{arm.joints[-1]}")
        self._solutions = geofikpy.franka_ik_q7
        assert np.allclose(geofikpy.franka_fk(arm.home), self.space.fk(arm.home))  # the arm that it knows

    def solve(self, target: Target, seed: Vector) -> Solution:
        T = target.T_base_ee
        found = np.array(self._solutions(T[:3, 3], T[:3, :3].ravel(), target.values[0])[0])
        candidates = found[~np.isnan(found).any(axis=1)]
        if not len(candidates):
            return Solution(seed, 0)
        return Solution(candidates[np.argmin(((candidates - seed) ** 2).sum(axis=1))], 0)


def peers(arm: Arm) -> list[Solver]:
    """The solvers whose libraries are installed."""
    found: list[Solver] = []
    for module, solver in {"mink": Mink, "pink": Pink}.items():
        if installed(module):
            found += [solver(arm, space) for space in ("task", "erj")]
    return [*found, GeoFik(arm)] if installed("geofikpy") else found


def versions() -> dict[str, str]:
    """Version of each distribution that is installed."""
    return {name: importlib.metadata.version(name) for module, name in PACKAGES.items() if installed(module)}


def installed(module: str) -> bool:
    """True if a module can be imported."""
    return importlib.util.find_spec(module) is not None


def _within_tolerance(error: Array) -> bool:
    """True if a pose's error (6,) [m, rad] is within the tolerances."""
    position, rotation = np.linalg.norm(error[:3]), np.linalg.norm(error[3:])
    return bool(position <= POSITION_TOLERANCE and rotation <= ROTATION_TOLERANCE)


def _mujoco_urdf(arm: Arm) -> str:
    """The arm's URDF with what MuJoCo needs: links without a mass, and frames that are fixed to others, are kept."""
    robot = ET.fromstring(arm.model_xml)
    compiler = ET.SubElement(ET.SubElement(robot, "mujoco"), "compiler")
    compiler.attrib.update(fusestatic="false", boundmass="1", boundinertia="1")
    return ET.tostring(robot, encoding="unicode")
