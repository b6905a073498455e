"""Attaching: a copy of a trained policy that decodes its actions itself, for LeRobot's own rollout.

LeRobot keeps a policy's pre- and post-processor beside its weights, as JSON. Its training command
builds them from the policy's type alone and has no room for another step, so the step is put in
afterwards. It goes into a copy, because simulated evaluation needs the policy as it was trained:
there the environment decodes.
"""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from safetensors import safe_open

from er_il.control.commander import BEST_EFFORT
from er_il.datasets.dataset import Dataset
from er_il.datasets.number_checks import check_numbers
from er_il.datasets.schema import STATE
from er_il.envs.contract import decodes, read_policy_config
from er_il.envs.trust import check_steps
from er_il.policy.training import pretrained
from er_il.robots.robot_commander import RobotCommander
from er_il.spaces.spec import ACTION
from er_il.support.atomic_files import check_absent, check_outside, check_writable
from er_il.support.errors import ErIlError, PolicyError, ShapeError
from er_il.support.json_files import read_json
from er_il.support.links import check_links

FASTEST = 1000  # [Hz] of any arm's control
FLOATS = ("F16", "F32", "F64")  # weights in other formats are left to LeRobot

if TYPE_CHECKING:
    from er_il.robots.processors import DecodePolicyAction


def attach(
    policy: Path,
    out: Path,
    *,
    dataset: Path | None = None,
    fps: float | None = None,
    on_invalid: str = BEST_EFFORT,
    trust: bool = False,
) -> "DecodePolicyAction":
    """Write a copy of a policy that decodes its own actions to joint vectors.

    The joint vectors have the names, order and units of the dataset that the policy's actions were
    encoded from: those of the robot that recorded it.

    Args:
        policy: Folder of a pretrained policy, or the output of a training.
        out: Folder that does not exist.
        dataset: The dataset that the policy was trained on; by default where it was then.
        fps: Rate of control [Hz]; the dataset's by default.
        on_invalid: The answer to an invalid action.
        trust: Accept a policy whose processors import what they name (:mod:`er_il.envs.trust`).

    Returns:
        The step that decodes.

    Raises:
        PolicyError: there is no policy, it decodes already, is not trusted, does not say where its dataset is, or its
            weights are not finite.
        DatasetError: there is no dataset, it does not say what its actions mean, or its numbers cannot be.
        ShapeError: the policy was not trained on this dataset.
        ErIlError: the rate is not positive or above ``FASTEST``, or there is no such answer to invalid actions.
        FileExistsError: ``out`` exists.
    """
    source = pretrained(policy)
    check_links(source)
    if not trust:
        check_steps(source)
    if decodes(source):
        raise PolicyError(f"The policy {source} decodes its actions already.")
    trained_on = Dataset(dataset or _trained_on(source))
    rate = trained_on.fps if fps is None else fps
    if not (isinstance(rate, int | float) and 0 < rate <= FASTEST):
        raise ErIlError(f"The rate of control is {rate} Hz; it must be positive, and at most {FASTEST} Hz.")
    period = 1.0 / rate
    RobotCommander(trained_on.layout, period, on_invalid)  # raises what building the step would
    check_numbers(trained_on, trained_on.layout)
    _check_weights(source)
    _check_shape(source, trained_on.features[ACTION]["shape"])
    check_absent(out)
    check_outside(out, source)
    check_writable(out)
    from er_il.robots.policy_copy import write_copy  # LeRobot: seconds of imports; mistakes are told before

    return write_copy(source, out, trained_on.spec, period, on_invalid, trained_on.names(STATE))


def _check_weights(policy: Path) -> None:
    """Refuse a policy with weights, or statistics to normalise by, that are not finite."""
    for path in sorted(policy.glob("*.safetensors")):
        with safe_open(path, framework="numpy") as file:
            for name in file.keys():  # noqa: SIM118  it is no mapping
                if file.get_slice(name).get_dtype() in FLOATS and not np.isfinite(file.get_tensor(name)).all():
                    raise PolicyError(f"The policy {policy} is damaged: {name} in {path.name} holds NaN or infinity.")


def _trained_on(policy: Path) -> Path:
    try:
        return Path(read_json(policy / "train_config.json", PolicyError)["dataset"]["root"])
    except (PolicyError, KeyError, TypeError) as error:
        raise PolicyError(f"The policy {policy} does not say where its dataset is; name it with --dataset.") from error


def _check_shape(policy: Path, needed: tuple[int, ...]) -> None:
    outputs = read_policy_config(policy).get("output_features") or {}
    if ACTION not in outputs:
        raise PolicyError(f"{policy / 'config.json'} is damaged: the policy has no {ACTION} among its output_features.")
    shape = outputs[ACTION]["shape"]
    if tuple(shape) != tuple(needed):
        raise ShapeError("The policy's action", tuple(shape), f"{tuple(needed)} as in the dataset")
