"""What a re-encoded dataset says about itself: provenance for programs, a section of its card for people."""

import json
import re
from pathlib import Path
from typing import Any

from lerobot.datasets import create_lerobot_dataset_card
from lerobot.datasets.utils import DatasetInfo

from er_il.spaces.layout import Layout
from er_il.support.provenance import provenance

HISTORY = Path("meta/er_il.json")
CARD = Path("README.md")
_START, _END = "<!-- er_il: start -->", "<!-- er_il: end -->"


def sign(dataset: Path, info: DatasetInfo, layout: Layout, source: str, options: dict[str, Any]) -> None:
    """Write where a dataset comes from and what its actions mean into its metadata and card.

    Args:
        dataset: Its folder.
        info: Its metadata.
        layout: How its actions are encoded.
        source: The dataset it was made from, its name or repository id.
        options: What else was asked for, as JSON.
    """
    path = dataset / HISTORY
    history: list[Any] = json.loads(path.read_text()) if path.exists() else []
    made = {key: value for key, value in provenance().items() if key != "machine"}
    path.write_text(json.dumps([*history, {"source": source, **options, **made}], indent=2))
    card = dataset / CARD
    text = card.read_text() if card.exists() else str(create_lerobot_dataset_card(dataset_info=info))
    text = re.sub(f"\n*{_START}.*{_END}\n*", "\n", text, flags=re.DOTALL)
    card.write_text(f"{text.rstrip()}\n\n{_START}\n{_section(layout, source)}\n{_END}\n")


def _section(layout: Layout, source: str) -> str:
    rows = [f"| {index} | `{name}` | {_meaning(layout, name)} |" for index, name in enumerate(layout.encoded_names)]
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


def _meaning(layout: Layout, name: str) -> str:
    for part in layout.parts:
        if name in part.motors.joints and name in layout.names:
            joint = part.space.arm.joints[part.motors.joints.index(name)]
            return f"joint `{joint}` [{part.motors.units}]"
        if name in part.names:
            own = part.space.names[part.names.index(name)]
            if own in ("ee.x", "ee.y", "ee.z", "ee.dx", "ee.dy", "ee.dz"):
                return "end-effector position [m]"
            if own.startswith("ee.q"):
                return "end-effector orientation, unit quaternion"
            return "end-effector orientation" if own.startswith("ee.") else "redundancy [rad]"
    return "as in the source"
