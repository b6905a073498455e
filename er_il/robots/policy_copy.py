"""Copies of a policy whose last step decodes its actions, by edits of LeRobot's pre- and post-processor."""

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lerobot.processor import RelativeActionsProcessorStep

from er_il.envs.contract import DECODE_POLICY_ACTION, RELATIVE_ACTIONS
from er_il.envs.trust import POSTPROCESSOR, PREPROCESSOR, read_processor
from er_il.robots.processors import DecodePolicyAction
from er_il.support.atomic_files import atomic_folder

_KEEP_STATE, _RENAME = "relative_actions_processor", "rename_observations_processor"


def write_copy(
    source: Path, out: Path, spec: dict[str, Any], period: float, on_invalid: str, state_names: Sequence[str]
) -> DecodePolicyAction:
    """Copy a pretrained policy with the step that decodes; return the step.

    Args:
        source: Folder of the policy.
        out: Folder that does not exist.
        spec: The specification of its actions.
        period: Control period [s].
        on_invalid: The answer to an invalid action.
        state_names: Names of what the policy sees as ``observation.state``.
    """
    step = DecodePolicyAction(spec=spec, period=period, on_invalid=on_invalid, state_names=list(state_names))
    with atomic_folder(out) as partial:
        shutil.copytree(source, partial)
        _edit(partial / PREPROCESSOR, _with_state_kept)
        _edit(partial / POSTPROCESSOR, lambda steps: [*steps, _entry(DECODE_POLICY_ACTION, step.get_config())])
    return step


def _with_state_kept(steps: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Add the step that keeps the raw state, where names are final and nothing is normalised yet."""
    names = [step.get("registry_name") for step in steps]
    if not {_KEEP_STATE, RELATIVE_ACTIONS}.isdisjoint(names):
        return steps
    at = names.index(_RENAME) + 1 if _RENAME in names else 0
    return [*steps[:at], _entry(_KEEP_STATE, RelativeActionsProcessorStep(enabled=False).get_config()), *steps[at:]]


def _entry(name: str, config: dict[str, Any]) -> dict[str, Any]:
    return {"registry_name": name, "config": config}


def _edit(path: Path, change: Any) -> None:
    pipeline = read_processor(path)
    pipeline["steps"] = change(pipeline["steps"])
    path.write_text(json.dumps(pipeline, indent=2))
