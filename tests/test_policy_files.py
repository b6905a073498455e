"""A policy whose files load, but are wrong inside, is told before anything moves."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from safetensors.torch import load_file, save_file

from er_il.policy.actor import Actor, environment_of
from er_il.support.errors import PolicyError

GOLDEN = Path(__file__).parent / "golden/policy"


@pytest.fixture
def policy(tmp_path: Path) -> Path:
    return Path(shutil.copytree(GOLDEN, tmp_path / "policy"))


def load(policy: Path) -> None:
    Actor.load(policy, environment_of(policy, "push_button_elbow", "erj"))


def test_incomplete_weights_are_told_and_not_left_random(policy: Path) -> None:
    load(policy)
    path = policy / "model.safetensors"
    weights = load_file(path)
    lost = sorted(weights)[len(weights) // 2]
    save_file({name: tensor.clone() for name, tensor in weights.items() if name != lost}, path)
    with pytest.raises(PolicyError, match=lost):
        load(policy)


@pytest.mark.parametrize(
    ("name", "step", "key", "value"),
    [
        ("policy_preprocessor.json", 3, "eps", "small"),
        ("policy_preprocessor.json", 3, "norm_map", {"STATE": "SOMEHOW"}),
        ("policy_preprocessor.json", 3, "features", {"observation.state": 7}),
        ("policy_postprocessor.json", 0, "norm_map", "MEAN_STD"),
    ],
)
def test_settings_of_a_wrong_type_are_found_by_a_trial_action(
    policy: Path, name: str, step: int, key: str, value: Any
) -> None:
    path = policy / name
    document = json.loads(path.read_text())
    assert key in document["steps"][step]["config"]
    document["steps"][step]["config"][key] = value
    path.write_text(json.dumps(document))
    with pytest.raises(PolicyError, match="cannot load the policy") as caught:
        load(policy)
    assert "\n" not in str(caught.value)
