"""Attaching: a copy of a trained policy that decodes its actions itself, for LeRobot's own rollout.

LeRobot keeps a policy's pre- and post-processor beside its weights, as JSON. Its training command
builds them from the policy's type alone and has no room for another step, so the step is put in
afterwards. It goes into a copy, because simulated evaluation needs the policy as it was trained:
there the environment decodes.
"""

import json
import shutil
from pathlib import Path
from typing import Any

from lerobot.policies.factory import POLICY_POSTPROCESSOR_DEFAULT_NAME, POLICY_PREPROCESSOR_DEFAULT_NAME
from lerobot.processor import RelativeActionsProcessorStep

from er_il.control.commander import BEST_EFFORT
from er_il.datasets.dataset import Dataset
from er_il.datasets.schema import STATE
from er_il.envs.contract import DECODE_POLICY_ACTION, decodes
from er_il.policy.training import pretrained
from er_il.robots.processors import DecodePolicyAction
from er_il.spaces.spec import ACTION
from er_il.support.atomic_files import atomic_folder
from er_il.support.errors import PolicyError, ShapeError

_PREPROCESSOR, _POSTPROCESSOR = (
    f"{name}.json" for name in (POLICY_PREPROCESSOR_DEFAULT_NAME, POLICY_POSTPROCESSOR_DEFAULT_NAME)
)
_KEEP_STATE, _RENAME = "relative_actions_processor", "rename_observations_processor"


def attach(
    policy: Path, out: Path, *, dataset: Path | None = None, fps: float | None = None, on_invalid: str = BEST_EFFORT
) -> DecodePolicyAction:
    """Write a copy of a policy that decodes its own actions to joint vectors.

    The joint vectors have the names, order and units of the dataset that the policy's actions were
    encoded from: those of the robot that recorded it.

    Args:
        policy: Folder of a pretrained policy, or the output of a training.
        out: Folder that does not exist.
        dataset: The dataset that the policy was trained on; by default where it was then.
        fps: Rate of control [Hz]; the dataset's by default.
        on_invalid: The answer to an invalid action.

    Returns:
        The step that decodes.

    Raises:
        PolicyError: there is no policy, it decodes already, or it does not say where its dataset is.
        DatasetError: there is no dataset, or it does not say what its actions mean.
        ShapeError: the policy was not trained on this dataset.
        FileExistsError: ``out`` exists.
    """
    source = pretrained(policy)
    if decodes(source):
        raise PolicyError(f"The policy {source} decodes its actions already.")
    trained_on = Dataset(dataset or _trained_on(source))
    step = DecodePolicyAction(
        spec=trained_on.spec,
        period=1.0 / (fps or trained_on.fps),
        on_invalid=on_invalid,
        state_names=list(trained_on.names(STATE)),
    )
    _check_shape(source, trained_on.features[ACTION]["shape"])
    with atomic_folder(out) as partial:
        shutil.copytree(source, partial)
        _edit(partial / _PREPROCESSOR, _with_state_kept)
        _edit(partial / _POSTPROCESSOR, lambda steps: [*steps, _entry(DECODE_POLICY_ACTION, step.get_config())])
    return step


def _trained_on(policy: Path) -> Path:
    try:
        return Path(json.loads((policy / "train_config.json").read_text())["dataset"]["root"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise PolicyError(f"The policy {policy} does not say where its dataset is; name it with --dataset.") from error


def _check_shape(policy: Path, needed: tuple[int, ...]) -> None:
    shape = json.loads((policy / "config.json").read_text())["output_features"][ACTION]["shape"]
    if tuple(shape) != tuple(needed):
        raise ShapeError("The policy's action", tuple(shape), f"{tuple(needed)} as in the dataset")


def _with_state_kept(steps: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Add the step that keeps the raw state, where names are final and nothing is normalised yet."""
    names = [step.get("registry_name") for step in steps]
    if _KEEP_STATE in names:
        return steps
    at = names.index(_RENAME) + 1 if _RENAME in names else 0
    return [*steps[:at], _entry(_KEEP_STATE, RelativeActionsProcessorStep(enabled=False).get_config()), *steps[at:]]


def _entry(name: str, config: dict[str, Any]) -> dict[str, Any]:
    return {"registry_name": name, "config": config}


def _edit(path: Path, change: Any) -> None:
    pipeline = json.loads(path.read_text())
    pipeline["steps"] = change(pipeline["steps"])
    path.write_text(json.dumps(pipeline, indent=2))
