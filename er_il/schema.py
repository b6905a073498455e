"""The columns of er_il's datasets, in LeRobot's terms (the card ``datasets/README.md`` explains them)."""

from collections.abc import Mapping
from typing import Any

from er_il.errors import DatasetError
from er_il.spaces import ActionSpace

ACTION = "action"
STATE = "observation.state"
ENVIRONMENT_STATE = "observation.environment_state"
IMAGES = "observation.images."
# Side columns. LeRobot makes every action* column a policy output and every observation* column an input.
LEADER_JOINTS = "leader.joints"
DEMO_SEED = "demo.seed"

SPEC = "er_il"  # features["action"]["info"][SPEC] is ActionSpace.spec()

Feature = dict[str, Any]


def features(
    space: ActionSpace,
    state_names: tuple[str, ...],
    environment_state_names: tuple[str, ...],
    cameras: tuple[str, ...],
    image_size: int,
) -> dict[str, Feature]:
    """Describe the columns of a dataset of demos, for ``LeRobotDataset.create``."""
    joint_names = tuple(f"{joint}.pos" for joint in space.arm.joints)
    image = {"dtype": "video", "shape": (image_size, image_size, 3), "names": ["height", "width", "channels"]}
    return {
        ACTION: action_feature(space),
        STATE: _vector(state_names),
        ENVIRONMENT_STATE: _vector(environment_state_names),
        LEADER_JOINTS: _vector((*joint_names, "gripper")),
        DEMO_SEED: {"dtype": "int64", "shape": (1,), "names": None},
        **{IMAGES + camera: dict(image) for camera in cameras},
    }


def action_feature(space: ActionSpace) -> Feature:
    """Describe the action column of a space; its specification travels in ``info``."""
    return _vector(space.names) | {"info": {SPEC: space.spec()}}


def action_spec(columns: Mapping[str, Feature]) -> dict[str, Any]:
    """Return the specification that :func:`action_feature` put there.

    Raises:
        DatasetError: the action column carries none.
    """
    try:
        return columns[ACTION]["info"][SPEC]
    except (KeyError, TypeError) as error:
        raise DatasetError("The dataset does not say what its actions mean (no er_il specification).") from error


def _vector(names: tuple[str, ...]) -> Feature:
    return {"dtype": "float32", "shape": (len(names),), "names": list(names)}
