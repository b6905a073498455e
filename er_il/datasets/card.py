"""Provenance of a re-encoded dataset: ``meta/er_il.json`` for programs, a section of its card for people."""

import json
import re
from pathlib import Path
from typing import Any

from lerobot.datasets import create_lerobot_dataset_card
from lerobot.datasets.io_utils import load_info

from er_il.datasets.dataset import Dataset
from er_il.kinematics.linear_coordinates import LinearCoordinates
from er_il.spaces.delta import DeltaSpace
from er_il.spaces.joint import JOINT
from er_il.spaces.layout import Layout, Part
from er_il.spaces.pose import PoseSpace
from er_il.support.errors import DatasetError
from er_il.support.provenance import provenance

HISTORY = Path("meta/er_il.json")
CARD = Path("README.md")

_MEANINGS = {  # of an arm's commands, by name
    r"ee\.[xyz]": "end-effector position [m]",
    r"ee\.q[xyzw]": "end-effector orientation, unit quaternion",
    r"ee\.r\d\d": "end-effector orientation, element of the rotation matrix",
    r"ee\.d[xyz]": "change of the end-effector position [m]",
    r"ee\.dr[xyz]": "change of the end-effector orientation, rotation vector [rad]",
    r".*\.delta": "change of the redundancy [rad]",
    r".*": "redundancy [rad]",
}

_START, _END = "<!-- er_il: start -->", "<!-- er_il: end -->"


def sign(dataset: Dataset, source: str, options: dict[str, Any]) -> None:
    """Write where a dataset comes from and what its actions mean into its metadata and card.

    Args:
        dataset: The dataset; it says what its actions mean.
        source: The dataset it was made from, its name or repository id.
        options: What else was asked for, as JSON.
    """
    path, history = dataset.root / HISTORY, read_history(dataset.root)
    made = {key: value for key, value in provenance().items() if key != "machine"}
    path.write_text(json.dumps([*history, {"source": source, **options, **made}], indent=2))
    card = dataset.root / CARD
    info = load_info(dataset.root)
    text = card.read_text() if card.exists() else str(create_lerobot_dataset_card(dataset_info=info))
    text = re.sub(f"\n*{_START}.*{_END}\n*", "\n", text, flags=re.DOTALL)
    card.write_text(f"{text.rstrip()}\n\n{_START}\n{_section(dataset.layout, source)}\n{_END}\n")


def read_history(root: Path) -> list[Any]:
    """Read what a dataset's re-encodings have written down so far; empty if it is none.

    Raises:
        DatasetError: the file is damaged.
    """
    path = root / HISTORY
    try:
        history = json.loads(path.read_text()) if path.exists() else []
    except (ValueError, RecursionError) as error:
        raise DatasetError(f"{path} is damaged, not valid JSON.") from error
    if not isinstance(history, list):
        raise DatasetError(f"{path} is damaged: it holds no list.")
    return history


def _section(layout: Layout, source: str) -> str:
    rows = [
        f"| {index} | `{name}` | {dimension_meaning(layout, name)} |" for index, name in enumerate(layout.encoded_names)
    ]
    arms = [
        f"- {part.label or 'arm'}: {part.space.arm.name}, pose of `{part.space.arm.ee_frame}` in "
        f"`{part.space.arm.base_frame}`, joints {', '.join(f'`{joint}`' for joint in part.motors.joints)} "
        f"[{part.motors.units}]"
        for part in layout.parts
    ]
    return "\n".join(
        [
            "## Actions",
            "",
            f"Re-encoded from `{source}` in the action space `{layout.kind}` by er_il. What the numbers mean",
            "exactly is in `meta/info.json` under `features.action.info.er_il`; `meta/er_il.json` says where they come",
            "from.",
            "",
            *arms,
            "",
            "| | Dimension | Meaning |",
            "|---|---|---|",
            *rows,
        ]
    )


def dimension_meaning(layout: Layout, name: str) -> str:
    """Describe a dimension of the encoded vector, with its unit."""
    for part in layout.parts:
        if layout.commands == JOINT and name in part.motors.joints:
            joint = part.space.arm.joints[part.motors.joints.index(name)]
            return f"joint `{joint}` [{part.motors.units}]"
        if layout.commands != JOINT and name in part.names:
            return _meaning(part, name.removeprefix(f"{part.label}_"))
    return "as in the source"


def _meaning(part: Part, command: str) -> str:
    joint, _, kind = command.rpartition(".")
    if joint in part.space.arm.joints:
        return f"{'change of joint' if kind == 'delta' else 'joint'} `{joint}` [rad]"
    space = part.space.absolute if isinstance(part.space, DeltaSpace) else part.space
    redundancy = space.redundancy if isinstance(space, PoseSpace) else None
    name = command.removesuffix(".delta")
    if isinstance(redundancy, LinearCoordinates) and name in redundancy.names:
        return f"{'change of the' if name != command else ''} self-motion {redundancy.formula(name)} [rad]".lstrip()
    return next(meaning for pattern, meaning in _MEANINGS.items() if re.fullmatch(pattern, command))
