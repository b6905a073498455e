"""The decoders that reports compare: an action space, and what IK does with the freedom it leaves.

Both decoders of task space read the same dataset and the same policy.
"""

from dataclasses import dataclass

from er_il.arm import Arm
from er_il.errors import UnknownNameError
from er_il.spaces import SPACES, ActionSpace, make_action_space

NEAREST, POSTURE = "nearest", "posture"
RESOLUTIONS = (NEAREST, POSTURE)


@dataclass(frozen=True)
class Decoder:
    """An action space by kind, and how IK resolves what the action leaves open.

    ``nearest`` takes the solution near the measured joints, ``posture`` the one near the arm's
    comfortable posture. Only task space leaves anything open.
    """

    space: str
    resolution: str = NEAREST

    def __post_init__(self) -> None:
        if self.space not in SPACES:
            raise UnknownNameError("action space", self.space, SPACES)
        if self.resolution not in RESOLUTIONS:
            raise UnknownNameError("resolution", self.resolution, RESOLUTIONS)

    def action_space(self, arm: Arm, rotation: str = "quat") -> ActionSpace:
        """Build the action space that decodes for an arm."""
        posture = arm.home if self.resolution == POSTURE else None
        return make_action_space(self.space, arm, rotation=rotation, posture=posture)


def _decoders() -> dict[str, Decoder]:
    table = {space: Decoder(space) for space in SPACES if space != "task"}
    table |= {f"task-{resolution}": Decoder("task", resolution) for resolution in RESOLUTIONS}
    return table


DECODERS = _decoders()  # by the name that reports use


def decoder(name: str) -> Decoder:
    """Return a decoder by its report name.

    Raises:
        UnknownNameError: no decoder has that name.
    """
    if name not in DECODERS:
        raise UnknownNameError("decoder", name, DECODERS)
    return DECODERS[name]
