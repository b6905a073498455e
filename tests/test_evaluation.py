import csv
import json
import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import torch
from lerobot.configs import FeatureType, PolicyFeature
from lerobot.policies import make_pre_post_processors
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.act.modeling_act import ACTPolicy

from er_il import Arm, make_action_space
from er_il.envs.contract import Contract
from er_il.evaluation.recording import record_rollout
from er_il.evaluation.results import as_csv, load_notes, load_rollouts, long_form, save_rollouts, summarise
from er_il.evaluation.rollout import Rollout
from er_il.evaluation.rollouts import evaluate
from er_il.support.counts import tally
from er_il.support.errors import ErIlError, PolicyError, UnknownNameError

PANDA = Arm.preset("panda")


@pytest.fixture(scope="module")
def policies(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Untrained policies that run into the cabinet, a little differently for every observation."""
    folder = tmp_path_factory.mktemp("policies")
    return {kind: _untrained(kind, folder / kind) for kind in ("joint", "task", "erj")}


def _untrained(kind: str, folder: Path) -> Path:
    torch.manual_seed(0)
    space = make_action_space(kind, PANDA)
    inside = np.array([0.118, 0.069, -0.115, -1.863, 0.05, 3.153, -2.398])  # straight into the cabinet
    config = ACTConfig(
        device="cpu",
        input_features={
            "observation.state": PolicyFeature(FeatureType.STATE, (15,)),
            "observation.environment_state": PolicyFeature(FeatureType.ENV, (7,)),
        },
        output_features={"action": PolicyFeature(FeatureType.ACTION, (space.dim,))},
        chunk_size=5,
        n_action_steps=1,
        temporal_ensemble_coeff=0.01,
        dim_model=32,
        dim_feedforward=32,
        n_heads=2,
        n_encoder_layers=1,
        use_vae=False,
        pretrained_backbone_weights=None,
        tags=[Contract.of_space(space).tag],
    )
    mean = torch.tensor(space.encode(inside), dtype=torch.float32)
    stats = {"action": {"mean": mean, "std": torch.full((space.dim,), 0.1)}}
    ACTPolicy(config).save_pretrained(folder)
    for processor in make_pre_post_processors(config, dataset_stats=stats):
        processor.save_pretrained(folder)
    return folder


def outcomes(rollouts: list[Rollout]) -> list[tuple[object, ...]]:
    return [(e.seed, e.success, e.failure, e.statuses, e.steps, e.joint_step) for e in rollouts]


@pytest.mark.slow
def test_neither_the_batch_nor_the_number_of_episodes_changes_an_outcome(policies: dict[str, Path]):
    runs = [
        evaluate(policies["joint"], "reach_cup", "joint", episodes=n, batch_size=batch)
        for n, batch in [(4, 1), (4, 3), (3, 25)]
    ]
    assert [seed for seed, *_ in outcomes(runs[0])] == [1000, 1001, 1002, 1003]
    assert outcomes(runs[0]) == outcomes(runs[1])
    assert outcomes(runs[2]) == outcomes(runs[0])[:3]
    assert len({e.joint_step for e in runs[0]}) == 4  # or equality would say nothing


def test_all_decoders_of_task_space_take_the_task_policy(policies: dict[str, Path]):
    for name in ("task-nearest", "task-posture", "task-clear"):
        (rollout,) = evaluate(policies["task"], "reach_cup", name, episodes=1)
        assert rollout.statuses.total() == rollout.steps


def test_every_rollout_keeps_clear_of_its_own_world(policies: dict[str, Path]):
    together = evaluate(policies["task"], "reach_cup", "task-clear", episodes=2)
    assert outcomes(together) == outcomes(
        evaluate(policies["task"], "reach_cup", "task-clear", episodes=2, batch_size=1)
    )


def test_a_policy_of_another_space_is_refused(policies: dict[str, Path]):
    with pytest.raises(PolicyError, match="space 'joint' not 'task'"):
        evaluate(policies["joint"], "reach_cup", "task-nearest", episodes=1)


def test_mistakes(policies: dict[str, Path], tmp_path: Path):
    with pytest.raises(UnknownNameError, match="reach_cup"):
        evaluate(policies["erj"], "reach_cap", "erj")
    with pytest.raises(UnknownNameError, match="task-nearest"):
        evaluate(policies["erj"], "reach_cup", "task")
    with pytest.raises(ErIlError, match="at least one"):
        evaluate(policies["erj"], "reach_cup", "erj", episodes=0)
    with pytest.raises(PolicyError, match="No policy at"):
        evaluate(tmp_path, "reach_cup", "erj")


def rollout(seed: int, failure: str = "", joint_step: float = 0.1) -> Rollout:
    return Rollout(seed, not failure, failure, Counter(ok=3, jump=1), (1e-3, 1e-3, 1e-3, 9e-3), joint_step)


def test_the_report_counts():
    rollouts = [rollout(7), rollout(8, "collision", 0.4), rollout(9, "timeout"), rollout(10)]
    frame = long_form([({"task": "reach_cup", "decoder": "erj", "training_seed": 3}, rollouts)])
    report = summarise(frame)
    assert (report["successes"], report["episodes"]) == (2, 4)
    assert report["interval"] == pytest.approx([0.0676, 0.9324], abs=1e-4)
    assert report["failures"] == {"collision": 1, "timeout": 1}
    assert report["statuses"] == {"ok": 12, "jump": 4}
    assert report["invalid_rate"] == pytest.approx(0.25)
    assert report["decode_p50_ms"] == pytest.approx(1.0)
    assert report["max_joint_step"] == pytest.approx(0.4)
    assert report["mean_steps"] == 4
    assert "elbow_error" not in report  # none was measured
    json.dumps(report)
    rows = list(csv.DictReader(as_csv(frame).splitlines()))
    assert [(row["training_seed"], row["seed"], row["success"], row["failure"]) for row in rows] == [
        ("3", "7", "1", ""),
        ("3", "8", "0", "collision"),
        ("3", "9", "0", "timeout"),
        ("3", "10", "1", ""),
    ]
    assert rows[1]["max_joint_step"] == "0.400000" and rows[1]["elbow_error"] == ""


def test_saved_rollouts_are_the_rollouts(tmp_path: Path):
    rollouts = [rollout(7), rollout(8, "collision", 0.4)]
    save_rollouts(rollouts, tmp_path / "new" / "rollouts.json", {"git": "0123abc"})
    assert load_rollouts(tmp_path / "new" / "rollouts.json") == rollouts
    assert load_notes(tmp_path / "new" / "rollouts.json") == {"git": "0123abc"}
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["rollouts.json"]


def test_a_recorded_rollout_is_the_evaluated_one(policies: dict[str, Path]):
    evaluated = evaluate(policies["erj"], "reach_cup", "erj", episodes=2)[1]
    trace, pictures = record_rollout(policies["erj"], "reach_cup", "erj", evaluated.seed, film_every=50)
    assert trace.outcome == evaluated.failure
    assert Counter(trace.status) == evaluated.statuses
    assert len(pictures) == math.ceil(len(trace) / 50) + 1
    assert pictures[0].shape == (480, 640, 3)


def test_tally_puts_the_most_common_first():
    assert tally({"timeout": 1, "no plan": 3}) == "no plan 3, timeout 1"
