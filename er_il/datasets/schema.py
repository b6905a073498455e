"""The columns of er_il's datasets, in LeRobot's terms (the card ``datasets/README.md`` explains them)."""

import math
from collections.abc import Mapping
from typing import Any

from er_il.spaces.layout import Layout
from er_il.spaces.spec import ACTION, SPEC

STATE = "observation.state"
ENVIRONMENT_STATE = "observation.environment_state"
IMAGES = "observation.images."
# Side columns. LeRobot makes every action* column a policy output and every observation* column an input.
LEADER_JOINTS = "leader.joints"
DEMO_SEED = "demo.seed"
SOURCE = "source."  # before the names of columns of a dataset that was re-encoded from another, as they were there
SOURCE_ACTION = SOURCE + "action"
SOURCE_JOINTS = SOURCE + "joints"  # the joint vectors that were encoded, where its actions were something else

Feature = dict[str, Any]


def features(
    layout: Layout,
    state_names: tuple[str, ...],
    environment_state_names: tuple[str, ...],
    cameras: tuple[str, ...],
    image_size: int,
) -> dict[str, Feature]:
    """Describe the columns of a dataset of demos, for ``LeRobotDataset.create``."""
    image = {"dtype": "video", "shape": (image_size, image_size, 3), "names": ["height", "width", "channels"]}
    return {
        ACTION: action_feature(layout),
        STATE: vector_feature(state_names),
        ENVIRONMENT_STATE: vector_feature(environment_state_names),
        LEADER_JOINTS: vector_feature(layout.names),
        DEMO_SEED: {"dtype": "int64", "shape": (1,), "names": None},
        **{IMAGES + camera: dict(image) for camera in cameras},
    }


def action_feature(layout: Layout, recorded: Feature | None = None) -> Feature:
    """Describe the action column of a layout; its specification travels in ``info``.

    Args:
        layout: What the actions mean.
        recorded: Description of the column that it replaces, if any; what else it says is kept.
    """
    before = recorded or {}
    info = (before.get("info") or {}) | {SPEC: layout.spec()}
    return before | vector_feature(layout.encoded_names) | {"info": info}


def dimension_names(feature: Feature) -> tuple[str, ...]:
    """Names of a column's dimensions, no two the same; their numbers if it does not name them all.

    Names may be nested, as in ``[["a", "b"]]`` (Unitree) or ``{"axes": ["a", "b"]}``. Those that occur more than once,
    such as LIBERO's two ``gripper``, are numbered: ``gripper_1``, ``gripper_2``.
    """
    names = _flat(feature.get("names") or [])
    found = [f"{each}_{names[: i + 1].count(each)}" if names.count(each) > 1 else each for i, each in enumerate(names)]
    count = math.prod(feature["shape"])
    return tuple(found) if len(found) == len(set(found)) == count else tuple(map(str, range(count)))


def _flat(names: Any) -> list[str]:
    if isinstance(names, Mapping):  # such as {"motors": [...]}, which older datasets have, or {"x": 0, "y": 1}
        return [each for name, group in names.items() for each in (_flat(group) if isinstance(group, list) else [name])]
    return [each for name in names for each in (_flat(name) if isinstance(name, list) else [str(name)])]


def vector_feature(names: tuple[str, ...]) -> Feature:
    """Describe a column of vectors with named dimensions."""
    return {"dtype": "float32", "shape": (len(names),), "names": list(names)}
