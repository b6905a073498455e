"""Policies other than ACT, trained and rolled out with the stock commands."""

import json
import sys
from pathlib import Path

import pytest
from lerobot.policies import PreTrainedPolicy
from lerobot.policies.diffusion.modeling_diffusion import DiffusionPolicy
from lerobot.scripts import lerobot_eval, lerobot_train
from rich.progress import Progress

from er_il.data.recipe import Recipe
from er_il.data.recording import generate
from er_il.policy.contract import policy_contract
from er_il.policy.evaluation import evaluate
from er_il.policy.training import Training
from er_il.resources import data_dir


def run(main: object, *arguments: str) -> None:
    """Run a stock command in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["command", *arguments])
        main()  # pyright: ignore[reportCallIssue]


@pytest.mark.slow
def test_diffusion_trains_on_an_er_dataset_and_rolls_out(tmp_path: Path):
    generate(Recipe.load("reach_cup").resized(2), ["erj"], tmp_path / "data", Progress(disable=True), workers=2)
    training = Training(
        task="reach_cup",
        space="erj",
        dataset=tmp_path / "data" / "erj",
        out=tmp_path / "policy",
        config=data_dir("configs") / "diffusion.yaml",
        steps=2,
        seed=0,
    )
    run(lerobot_train.main, *training.command[1:], "--batch_size=4", "--policy.num_inference_steps=2")
    loaded: PreTrainedPolicy = DiffusionPolicy.from_pretrained(training.policy)
    assert loaded.config.output_features["action"].shape == (9,)
    assert policy_contract(training.policy).space == "erj"
    rollout = ["--env.type=er_il", "--env.task=reach_cup", "--env.action_space=erj", "--eval.recording=true"]
    rollout += ["--eval.n_episodes=1", "--eval.batch_size=1", f"--output_dir={tmp_path / 'eval'}"]
    run(lerobot_eval.main, f"--policy.path={training.policy}", *rollout)
    overall = json.loads((tmp_path / "eval" / "eval_info.json").read_text())["overall"]
    assert overall["n_episodes"] == 1
    # The noise is drawn anew in every rollout, from the rollout's seed.
    first, second = (evaluate(training.policy, "reach_cup", "erj", episodes=1).episodes[0] for _ in range(2))
    assert (first.steps, first.joint_step) == (second.steps, second.joint_step)
