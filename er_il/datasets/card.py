"""Provenance of a re-encoded dataset: ``meta/er_il.json`` for programs, a section of its card for people."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from huggingface_hub import DatasetCard
from lerobot.datasets import create_lerobot_dataset_card
from lerobot.datasets.io_utils import load_info
from yaml import YAMLError

from er_il.arms.presets import PRESETS
from er_il.datasets.dataset import Dataset
from er_il.datasets.history import append_to_history
from er_il.kinematics.linear_coordinates import LinearCoordinates
from er_il.kinematics.rotation import Quaternion
from er_il.spaces.delta import DeltaSpace
from er_il.spaces.joint import JOINT
from er_il.spaces.layout import Layout, Part
from er_il.spaces.pose import PoseSpace
from er_il.spaces.registry import SPACES
from er_il.support.provenance import provenance

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
_VISUALISER = "https://huggingface.co/spaces/lerobot/visualize_dataset?path="  # a space of LeRobot's
_BADGE = re.compile(rf'<a [^>]*href="{re.escape(_VISUALISER)}[^"]*">.*?</a>\n*', re.DOTALL)


def sign(dataset: Dataset, source: str, options: dict[str, Any], notes: Sequence[str] = (), repo_id: str = "") -> None:
    """Write where a dataset comes from and what its actions mean into its metadata and card.

    Args:
        dataset: The dataset; it says what its actions mean.
        source: The dataset it was made from, its name or repository id.
        options: What else was asked for, as JSON; ``retargeted``: the arms that were others, by what they are called.
        notes: What else its user should know of the actions, a sentence or more each.
        repo_id: Where it will be on the hub, for the link to LeRobot's visualiser.

    Raises:
        DatasetError: what was written before is damaged.
    """
    made = {key: value for key, value in provenance().items() if key != "machine"}
    append_to_history(dataset.root, {"source": source, **options, **made})
    file = dataset.root / CARD
    fresh = create_lerobot_dataset_card(dataset_info=load_info(dataset.root), repo_id=repo_id)
    card = _read_card(file.read_text(), fresh) if file.exists() else fresh
    stale = {*SPACES, *PRESETS}
    tags = [tag for tag in card.data.get("tags") or [] if tag not in stale]
    own = ("LeRobot", "er_il", dataset.layout.kind, *(arm.name for arm in dataset.layout.arms.values()))
    card.data["tags"] = list(dict.fromkeys([*tags, *own]))
    text = re.sub(f"\n*{_START}.*{_END}\n*", "\n", _BADGE.sub("", card.text), flags=re.DOTALL).strip()
    badge = next(iter(_BADGE.findall(fresh.text)), "").strip()
    section = "\n".join([_START, _section(dataset, source, options.get("retargeted", {}), notes), _END])
    card.text = "\n" + "\n\n".join(filter(None, (badge, text, section))) + "\n"
    file.write_text(str(card))


def _read_card(text: str, fresh: DatasetCard) -> DatasetCard:
    """The card of a text; where its metadata are damaged, the fresh card's above all of the text."""
    try:
        return DatasetCard(text)
    except (ValueError, YAMLError):
        fresh.text = text
        return fresh


def _section(dataset: Dataset, source: str, retargeted: dict[str, Any], notes: Sequence[str]) -> str:
    layout = dataset.layout
    rows = [
        f"| {index} | `{name}` | {dimension_meaning(layout, name)} |" for index, name in enumerate(layout.encoded_names)
    ]
    arms = [
        f"The motion of {name} was another arm's: retargeted from {each['from']} to {each['to']}, positions about the "
        f"shoulder times {each['scale']:.4g}. Images and objects are still those of {each['from']}."
        for name, each in retargeted.items()
    ]
    made = "Retargeted" if retargeted else "Re-encoded"
    return "\n".join(
        [
            "## Actions",
            "",
            f"{made} from `{source}` in the action space `{layout.kind}` by er_il. What the numbers mean",
            "exactly is in `meta/info.json` under `features.action.info.er_il`; `meta/er_il.json` says where they come",
            "from.",
            "",
            *(line for note in notes for line in (note, "")),
            *arms,
            *([""] if arms else []),
            "| Property | Value |",
            "|---|---|",
            *(f"| {name} | {value} |" for name, value in _specification(dataset)),
            "",
            "| | Dimension | Meaning |",
            "|---|---|---|",
            *rows,
        ]
    )


def _specification(dataset: Dataset) -> Iterator[tuple[str, str]]:
    """The specification of the actions, a property and its value at a time."""
    layout = dataset.layout
    yield "Action space", f"`{layout.kind}`"
    yield "Episodes, frames, rate", f"{dataset.count}, {dataset.frames}, {dataset.fps:g} Hz"
    for part in layout.parts:
        arm, space, motors = part.space.arm, part.space, part.motors
        of = f" of {part.label}" if part.label else ""
        yield f"Arm{of}", arm.name
        yield f"Pose{of}", f"`{arm.ee_frame}` in `{arm.base_frame}`"
        yield f"Joints{of}", f"{', '.join(f'`{joint}`' for joint in motors.joints)} [{motors.units}]"
        if not motors.plain:
            yield f"Signs, offsets{of}", f"{_numbers(motors.signs) or '1'}, {_numbers(motors.offsets) or '0'}"
        absolute = space.absolute if isinstance(space, DeltaSpace) else space
        if isinstance(absolute, PoseSpace):
            if absolute is space:
                yield f"Rotation{of}", _rotation(absolute)
            if absolute.redundancy_names:
                yield f"Redundancy{of}", ", ".join(f"`{name}`" for name in absolute.redundancy_names)
    if layout.other_dimensions:
        yield "Passed through", ", ".join(f"`{name}`" for name in layout.other_dimensions)


def _rotation(space: PoseSpace) -> str:
    code = space.rotation
    if isinstance(code, Quaternion):
        return f"`{code.kind}`: unit quaternion (x, y, z, w), first on the side of ({_numbers(code.reference)})"
    return f"`{code.kind}`: {len(code.names)} elements of the rotation matrix"


def _numbers(values: Sequence[float]) -> str:
    return " ".join(f"{value:.4g}" for value in values)


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
