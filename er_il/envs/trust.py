"""Policies from others are data: what of a policy LeRobot would execute is refused before LeRobot sees it.

LeRobot 0.6.1 imports and calls whatever a processor file names as the ``class`` of a step
(``DataProcessorPipeline._resolve_step_class``). Steps by their registered names come from installed packages alone.
"""

from pathlib import Path
from typing import Any

from pydantic import BaseModel, StrictStr

from er_il.envs.origin import policy_file
from er_il.support.declaration import check_values
from er_il.support.errors import PolicyError
from er_il.support.json_files import read_json

PROCESSORS = PREPROCESSOR, POSTPROCESSOR = "policy_preprocessor.json", "policy_postprocessor.json"


class _Processor(BaseModel):
    """What er_il needs of a policy's pre- and post-processor."""

    steps: list[dict[StrictStr, Any]]


def read_processor(path: Path) -> dict[str, Any]:
    """Read a policy's pre- or post-processor.

    Raises:
        PolicyError: it is missing or damaged.
    """
    processor = read_json(path, PolicyError)
    check_values(_Processor, processor, path, PolicyError)
    return processor


def check_steps(policy: str | Path) -> None:
    """Refuse a policy whose processors have a step that is not named by its registered name.

    Args:
        policy: Folder of a pretrained policy, or its Hub id.

    Raises:
        PolicyError: there is such a step, or a processor file cannot be read.
    """
    for name in PROCESSORS:
        file = policy_file(policy, name)
        if file is None:
            continue  # LeRobot loads none, or says what it misses
        for step in read_processor(file)["steps"]:
            registered, imported = step.get("registry_name"), step.get("class")
            if imported is not None or not isinstance(registered, str):
                raise PolicyError(
                    f"{file} asks LeRobot to import and call {imported!r}, which may be any program. "
                    "If you trust where the policy comes from: --trust (lerobot-eval: --env.trust=true)."
                )
