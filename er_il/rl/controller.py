"""JAiLeR's view of the arm (Kumar et al. 2021, paper V-A): a goal of the hand, and a controller that goes there.

A task policy says how the hand's pose is to change, in shares of the paper's largest changes; the goal counts from the
pose measured. A controller sees the arm and what is left to the goal, and changes the joints.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from er_il.envs.learning import BOUNDS, RATE
from er_il.envs.learning_state import TURN_NAMES
from er_il.spaces.delta import POSE_NAMES

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

GOAL_NAMES = POSE_NAMES  # of the task policy's action, before the gripper
ERROR, EFFORT = 20.0, 0.005  # [1/m² and 1/rad², s²/rad] lambda_err and lambda_eff of the paper
TASK_SHARE = 0.05  # lambda_task of JAiLeR (+rew)
_SCALE = np.repeat([BOUNDS.position, BOUNDS.rotation], 3)  # (6,) [m, rad] of an action's shares


@dataclass(frozen=True)
class ControllerView:
    """What of the state (:class:`er_il.envs.learning_state.LearningState`) concerns the controller."""

    names: tuple[str, ...]  # of the state's dimensions

    @property
    def columns(self) -> list[int]:
        """Where the state holds joint angles, joint velocities, and what is left to the last command."""
        return [i for ending in (".pos", ".vel", ".left") for i in self._of(ending)]

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of what the controller observes."""
        return (*(self.names[i] for i in self.columns), *(f"{name}.share" for name in GOAL_NAMES))

    def observe(self, states: Floats, changes: Floats) -> Floats:
        """The controller's observations (N, 3n + 6) from states (N, s) and the changes asked for (N, 6) in [-1, 1]."""
        return np.hstack([states[:, self.columns], changes[:, : len(GOAL_NAMES)]]).astype(np.float32)

    def goals(self, states: Floats, changes: Floats) -> tuple[Array, Rotation]:
        """Positions (N, 3) [m] and orientations to which changes (N, 6) in [-1, 1] would bring the hand."""
        positions, turns = self._hand(states)
        shares = changes[:, : len(GOAL_NAMES)].astype(np.float64) * _SCALE
        return positions + shares[:, :3], Rotation.from_rotvec(shares[:, 3:]) * turns

    def errors(self, states: Floats, goals: tuple[Array, Rotation]) -> Array:
        """What hands lack to goals (N, 6): translations [m], and rotation vectors [rad] in the base frame."""
        positions, turns = self._hand(states)
        return np.hstack([goals[0] - positions, (goals[1] * turns.inv()).as_rotvec()])

    def rewards(self, before: Floats, after: Floats, goals: tuple[Array, Rotation]) -> Array:
        """Of each controller (N,) for a decision: exp(-20 |error|²) - 0.005 |acceleration| (the paper's equation)."""
        error = np.square(self.errors(after, goals)).sum(axis=1)
        velocities = self._of(".vel")
        acceleration = (after[:, velocities] - before[:, velocities]).astype(np.float64) * RATE
        return np.exp(-ERROR * error) - EFFORT * np.linalg.norm(acceleration, axis=1)

    def shares(self, errors: Array) -> Floats:
        """Errors (N, 6) [m, rad] as the changes that would mend them, in the units of the task policy's actions."""
        return (errors / _SCALE).astype(np.float32)

    def _hand(self, states: Floats) -> tuple[Array, Rotation]:
        """Measured positions (N, 3) [m] and orientations of the hand."""
        first = self.names.index("ee.x")
        hand = states[:, first : first + 3 + len(TURN_NAMES)].astype(np.float64)
        x, y = hand[:, 3:6], hand[:, 6:]
        return hand[:, :3], Rotation.from_matrix(np.stack([x, y, np.cross(x, y)], axis=2))

    def _of(self, ending: str) -> list[int]:
        return [i for i, name in enumerate(self.names) if name.endswith(ending)]
