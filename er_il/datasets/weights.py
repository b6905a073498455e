"""Files of ERX's weights: what ``er-il advise --fit erx`` writes and ``er-il encode`` and ``er-il generate`` read."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Self

from pydantic import StrictFloat, StrictInt, StrictStr

from er_il.arms.arm import Arm, Weights
from er_il.spaces.registry import AT, ERX, split_name
from er_il.support.atomic_files import write_json
from er_il.support.declaration import Declaration
from er_il.support.errors import ArmError, DatasetError


class ArmWeights(Declaration):
    """W (n-6, n) of one arm."""

    noun = "entry of weights"
    error = DatasetError

    arm: StrictStr
    fingerprint: StrictStr  # of its kinematics
    joints: tuple[StrictStr, ...]
    weights: tuple[tuple[StrictFloat | StrictInt, ...], ...]

    @classmethod
    def of(cls, arm: Arm, weights: Weights) -> Self:
        """The entry of an arm."""
        return cls(arm=arm.name, fingerprint=arm.fingerprint, joints=arm.joints, weights=weights)

    def for_arm(self, arm: Arm) -> Weights:
        """The weights, if they are that arm's.

        Raises:
            DatasetError: they are of another arm, or of joints in another order, or no orthonormal rows.
        """
        if self.fingerprint != arm.fingerprint or self.joints != arm.joints:
            raise DatasetError(
                f"The weights are of {self.arm} ({self.fingerprint}; {', '.join(self.joints)}), the actions of "
                f"{arm.name} ({arm.fingerprint}; {', '.join(arm.joints)})."
            )
        try:
            return arm.weighing(self.weights).weights
        except ArmError as error:
            raise DatasetError(str(error)) from error


class WeightsFile(Declaration):
    """The weights of each arm of a robot, by its label; "" where there is only one."""

    noun = "file of weights"
    error = DatasetError

    arms: Mapping[StrictStr, ArmWeights]

    def of(self, arms: Mapping[str, Arm]) -> dict[str, Weights]:
        """The weights of arms by their labels.

        Raises:
            DatasetError: the file is of other arms.
        """
        if set(self.arms) != set(arms):
            raise DatasetError(f"The weights are of the arms {_listed(self.arms)}, the actions of {_listed(arms)}.")
        return {label: self.arms[label].for_arm(arm) for label, arm in arms.items()}

    def write(self, path: Path) -> None:
        """Write the file."""
        write_json(path, self.to_dict())


def read_weights(path: Path | None, spaces: Sequence[str]) -> WeightsFile | None:
    """Read a file of weights for the action spaces in which something is to be written; None without a path.

    Raises:
        DatasetError: it is none, or none of the spaces is ERX by the arm's own weights.
        UnknownNameError: no such space.
    """
    if path is None:
        return None
    if not any(split_name(space)[0].endswith(ERX) and AT not in space for space in spaces):
        raise DatasetError(f"Weights are for {ERX}, not for {', '.join(spaces)}: leave out --weights.")
    return WeightsFile.from_file(path)


def _listed(arms: Mapping[str, object]) -> str:
    return ", ".join(map(repr, arms))
