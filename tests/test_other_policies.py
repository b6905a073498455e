"""Policies other than ACT, trained and rolled out with the stock commands."""

import json
from pathlib import Path

import pytest
from documented import ROOT, documented, run, train_in_process
from lerobot.policies import PreTrainedPolicy
from lerobot.policies.diffusion.modeling_diffusion import DiffusionPolicy

from er_il.envs.contract import policy_contract
from er_il.evaluation.rollouts import evaluate
from er_il.policy.training import pretrained


@pytest.mark.slow
def test_diffusion_trains_on_an_er_dataset_and_rolls_out(
    reach_cup: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    Path("configs").symlink_to(ROOT / "configs")
    Path("datasets").symlink_to(reach_cup.parent)
    train_in_process(monkeypatch, "--batch_size=4", "--policy.num_inference_steps=2")
    run("er-il", *documented("docs/policies.md", "er-il train"), "--steps", "2")
    policy = pretrained(Path("policies/reach_cup/erj_diffusion"))
    loaded: PreTrainedPolicy = DiffusionPolicy.from_pretrained(policy)
    assert loaded.config.output_features["action"].shape == (9,)
    assert policy_contract(policy).space == "erj"
    rollout = ["--env.type=er_il", "--env.task=reach_cup", "--env.action_space=erj", "--eval.recording=true"]
    rollout += ["--eval.n_episodes=1", "--eval.batch_size=1", f"--output_dir={tmp_path / 'eval'}"]
    run("lerobot-eval", f"--policy.path={policy}", *rollout)
    overall = json.loads((tmp_path / "eval" / "eval_info.json").read_text())["overall"]
    assert overall["n_episodes"] == 1
    run("er-il", *documented("docs/policies.md", "er-il eval"), "--episodes", "1", "--out", "first")
    (first,) = json.loads(Path("first/report.json").read_text())["cells"]
    # The noise is drawn anew in every rollout, from the rollout's seed.
    second = evaluate(policy, "reach_cup", "erj", episodes=1)[0]
    assert (first["mean_steps"], first["max_joint_step"]) == (second.steps, second.joint_step)
