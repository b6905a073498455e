"""Options that describe the arm of a dataset without a specification, shared by all commands that need it."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

if TYPE_CHECKING:
    from er_il.datasets.wiring import Wiring

Names = Annotated[tuple[str, ...], arg(metavar="NAME ...")]
Numbers = Annotated[tuple[float, ...], arg(metavar="X ...")]


@dataclass(frozen=True)
class ArmOptions:
    """The arm, and the dimensions that are its joints."""

    arm: str = ""
    """Preset (panda, panda8, fr3, xarm7, gen3, openarm_v2_left, ...), or path of a URDF."""
    ee_frame: str = ""
    """Link whose pose the actions command; a URDF needs it."""
    base_frame: str = ""
    """Link in which poses are expressed; the URDF's root if omitted."""
    from_: Annotated[Names, arg(name="from")] = ()
    """Columns that hold the joints, if action does not: COLUMN, or COLUMN:NAME,NAME for some of its dimensions, either
    also after DATASET: for another dataset of the same frames. What was measured commands the frame before: all columns
    that are not named as actions, commands, goals, targets or a leader's."""
    state_from: Names = ()
    """Columns of the measured joints, likewise, if observation.state does not have them: it becomes what they hold."""
    joints: Names = ()
    """Dimensions of the action that are the arm's joints, base first; found by the arm's joint names if omitted.
    All other dimensions, such as the gripper, are passed through."""
    state_joints: Names = ()
    """The same of observation.state; those of the same names if omitted."""
    units: str = "rad"
    """Units of the joints in the dataset: rad or deg."""
    signs: Numbers = ()
    """1 or -1 for each joint: the URDF's angle is sign * value + offset."""
    offsets: Numbers = ()
    """Offset of each joint, in the dataset's units."""
    urdf_joints: Names = ()
    """Joints of the URDF, base first; all between base and end effector if omitted."""
    arms: Path | None = None
    """YAML file with one entry an arm, for several arms, in place of the options above; or openarm_v1, openarm_v2:
    two OpenArms as LeRobot's driver records them."""

    def wiring(self, redundant: tuple[str, ...] = (), angle_frames: tuple[str, ...] = ()) -> "Wiring":
        """The one arm that the options describe."""
        from er_il.datasets.wiring import Wiring

        own = {key: value for key, value in vars(self).items() if key != "arms"}
        return Wiring(**own, redundant=redundant, angle_frames=angle_frames)

    def wirings(self, redundant: tuple[str, ...] = (), angle_frames: tuple[str, ...] = ()) -> "list[Wiring]":
        """All arms; none if nothing is said.

        Raises:
            ErIlError: both an arm and a file of arms are given, or they are wrong.
        """
        from er_il.arms.presets import ROBOTS
        from er_il.datasets.wiring import read_wirings
        from er_il.support.errors import DatasetError

        if self.arms is not None and self.arm:
            raise DatasetError("Give either --arm or --arms.")
        if self.arms is not None:
            return [self._in_columns(each) for each in read_wirings(self.arms)]
        if not self.arm:
            if self.from_ or self.state_from:
                raise DatasetError("--from and --state-from say where an arm's joints are: give --arm or --arms, too.")
            return []
        if self.arm in ROBOTS:
            raise DatasetError(f"{self.arm} has several arms: give --arms {self.arm}.")
        wiring = self.wiring(redundant, angle_frames)
        wiring.build_arm()
        return [wiring]

    def _in_columns(self, wiring: "Wiring") -> "Wiring":
        """An arm of a file, in the columns of the options where the file names none."""
        return wiring.replaced(
            from_=wiring.from_ or self.from_,
            state_from=wiring.state_from or self.state_from,
        )
