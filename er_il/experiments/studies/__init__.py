"""Studies of the action spaces by kinematics."""

from collections.abc import Callable, Mapping, Sequence

from er_il.datasets.joint_paths import JointPath

Demos = Mapping[str, Sequence[JointPath]]  # by task or dataset
Advance = Callable[[int, int], object]  # called with the number of measurements done and their total
