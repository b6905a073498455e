"""References: which of two quaternions, and which turn of an arm angle, stands for a posture.

An episode's first quaternion takes the sign nearer to the reference and later ones follow on. So
episodes agree with each other if the reference has all their orientations in its hemisphere, and
disagree where an orientation lies half a turn from it, by chance on the one side or the other.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from er_il.kinematics.rotation import Quaternion
from er_il.spaces.base import ArmSpace
from er_il.spaces.pose import PoseSpace

Array = NDArray[np.float64]

MARGIN = 0.2  # |cosine| of half the angle to the reference, above which no sign is in doubt
SAMPLES = 20_000  # postures that references are fitted to


def fitted(space: ArmSpace, q: ArrayLike) -> ArmSpace:
    """The same space with references that suit postures (N, n) [rad].

    Those of the arm's home posture stay where they suit, so that datasets encoded one by one agree
    and can be merged.
    """
    postures = np.asarray(q, dtype=np.float64)
    postures = postures[np.all(np.isfinite(postures), axis=1)]
    postures = postures[:: 1 + len(postures) // SAMPLES]
    if not len(postures) or not isinstance(space, PoseSpace):
        return space
    if isinstance(space.rotation, Quaternion):
        quaternions = Rotation.from_matrix(space.kinematics.fk_batch(postures)[:, :3, :3]).as_quat()
        space = replace(space, rotation=Quaternion(_hemisphere(quaternions, space.rotation.reference)))
    return space.fitted(postures)


def _hemisphere(quaternions: Array, home: Sequence[float]) -> tuple[float, float, float, float]:
    reference = np.asarray(home)
    if np.abs(quaternions @ reference).min() < MARGIN:
        # The axis with the largest mean squared cosine: signs do not matter to it. Rounded, for
        # similar data shall have the same.
        main = np.linalg.eigh(quaternions.T @ quaternions)[1][:, -1].round(1)
        main *= np.sign(main[np.abs(main).argmax()]) / np.linalg.norm(main)
        if np.abs(quaternions @ main).min() > np.abs(quaternions @ reference).min():
            reference = main
    x, y, z, w = reference.tolist()
    return x, y, z, w
