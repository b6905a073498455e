import json
import sys
from collections.abc import Iterator
from pathlib import Path

import gymnasium
import pytest
import torch
from lerobot.scripts import lerobot_edit_dataset, lerobot_eval, lerobot_train
from rich.progress import Progress

import er_il.policy.in_memory
from er_il import cli
from er_il.datasets.recipe import Recipe
from er_il.datasets.recording import generate
from er_il.envs.tasks import task_id
from er_il.evaluation.rollouts import evaluate
from er_il.policy.configuration import default_config, input_features
from er_il.policy.training import Training, pretrained
from er_il.support.errors import DatasetError, PolicyError, UnknownNameError


@pytest.fixture
def datasets(reach_cup: Path) -> Path:
    return reach_cup


@pytest.fixture
def one_thread() -> Iterator[None]:
    """As many threads as `er-il train` uses: rounding depends on them."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


def training(datasets: Path, out: Path, **changes: object) -> Training:
    settings = {"space": "erj", "dataset": datasets / "erj", "config": default_config("erj"), "steps": 2} | changes
    return Training(task="reach_cup", out=out, seed=0, **settings)  # pyright: ignore[reportArgumentType]


def run(monkeypatch: pytest.MonkeyPatch, main: object, *arguments: str) -> None:
    """Run a stock command in this process."""
    monkeypatch.setattr(sys, "argv", ["command", *arguments])
    main()  # pyright: ignore[reportCallIssue]


def run_in_memory(monkeypatch: pytest.MonkeyPatch, training: Training) -> None:
    """Train as ``er-il train`` does, but in this process; test_demo's trainings run in their own."""
    training.prepare()
    with monkeypatch.context() as patch:
        patch.setattr(lerobot_train, "make_train_eval_datasets", lerobot_train.make_train_eval_datasets)  # to undo
        run(patch, er_il.policy.in_memory.main, *training.command[1:])


def test_the_command_trains_on_the_training_episodes_and_declares_the_actions(datasets: Path, tmp_path: Path):
    command = training(datasets, tmp_path / "out").command
    assert command[0] == "lerobot-train"
    assert "--dataset.episodes=[0,1]" in command
    assert '--policy.tags=["er_il:erj/panda/panda_hand_tcp/quat/panda_joint1"]' in command


def test_inputs_are_those_of_the_configuration_in_the_shapes_of_the_dataset(tmp_path: Path):
    features = {
        "observation.state": {"shape": [16]},
        "observation.environment_state": {"shape": [28]},
        "observation.images.wrist": {"shape": [96, 128, 3]},
        "observation.images.shoulder": {"shape": [96, 128, 3]},
    }
    state, poses = {"type": "STATE", "shape": [16]}, {"type": "ENV", "shape": [28]}
    assert input_features(default_config("erj"), features) == {
        "observation.state": state,
        "observation.environment_state": poses,
    }
    images, camera = default_config("erj").with_name("act_erj_images.yaml"), {"type": "VISUAL", "shape": [3, 96, 128]}
    assert input_features(images, features) == {
        "observation.state": state,
        "observation.images.wrist": camera,
        "observation.images.shoulder": camera,
    }
    with pytest.raises(PolicyError, match="Record it with --cameras"):
        input_features(images, {"observation.state": {"shape": [16]}})
    with pytest.raises(PolicyError, match=r"wants observation\.environment_state"):
        input_features(default_config("erj"), {"observation.state": {"shape": [16]}})
    own = tmp_path / "own.yaml"
    own.write_text("policy: {type: act}")
    assert input_features(own, features) == {}


@pytest.mark.slow
@pytest.mark.usefixtures("one_thread")
def test_from_demonstrations_to_a_rollout_with_the_stock_commands(
    datasets: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    out = tmp_path / "policy"
    first = training(datasets, out)
    assert first.done_steps == 0
    run(monkeypatch, lerobot_train.main, *first.command[1:])
    assert first.finished
    longer = training(datasets, out, steps=4)
    assert (longer.done_steps, longer.finished) == (2, False)
    assert "--resume=true" in longer.command
    run(monkeypatch, lerobot_train.main, *longer.command[1:])
    assert (longer.done_steps, longer.finished) == (4, True)
    in_memory = training(datasets, tmp_path / "in_memory", steps=2)
    run_in_memory(monkeypatch, in_memory)
    weights = "checkpoints/000002/pretrained_model/model.safetensors"
    assert (in_memory.out / weights).read_bytes() == (out / weights).read_bytes()

    config = json.loads((longer.policy / "train_config.json").read_text())
    assert config["dataset"]["episodes"] == [0, 1]

    # Recording instead of filming: people's pictures take longer than the rollout itself.
    rollout = ["--env.type=er_il", "--env.task=reach_cup", f"--policy.path={longer.policy}", "--eval.recording=true"]
    rollout += ["--eval.n_episodes=2", "--eval.batch_size=2", "--eval.use_async_envs=false"]
    results = tmp_path / "eval"
    run(monkeypatch, lerobot_eval.main, *rollout, "--env.action_space=erj", f"--output_dir={results}")
    overall = json.loads((results / "eval_info.json").read_text())["overall"]
    assert overall["n_episodes"] == 2
    ours = evaluate(longer.policy, "reach_cup", "erj", episodes=2)
    assert overall["pc_success"] == 50 * sum(rollout.success for rollout in ours)

    with pytest.raises(PolicyError, match="space 'erj' not 'joint'"):
        run(monkeypatch, lerobot_eval.main, *rollout, "--env.action_space=joint", f"--output_dir={tmp_path / 'no'}")


@pytest.mark.slow
@pytest.mark.usefixtures("one_thread")
def test_from_images_to_a_rollout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    recipe = Recipe.load("push_button_elbow").resized(2).replaced(cameras=("shoulder",), image_size=32)
    generate(recipe, ["erj"], tmp_path / "data", Progress(disable=True), workers=1)
    changes = {"dataset": tmp_path / "data" / "erj", "config": default_config("erj", "images_small")}
    stock, in_memory = (training(tmp_path, tmp_path / name, **changes) for name in ("stock", "in_memory"))
    stock.prepare()
    run(monkeypatch, lerobot_train.main, *stock.command[1:])
    run_in_memory(monkeypatch, in_memory)
    weights = [each.policy / "model.safetensors" for each in (stock, in_memory)]
    assert weights[0].read_bytes() == weights[1].read_bytes()
    seen = json.loads((stock.policy / "config.json").read_text())["input_features"]
    assert set(seen) == {"observation.state", "observation.images.shoulder"}  # the button has to be found
    monkeypatch.setattr(gymnasium.spec(task_id("push_button_elbow")), "max_episode_steps", 20)
    (rollout,) = evaluate(stock.policy, "push_button_elbow", "erj", episodes=1, batch_size=1)
    assert rollout.steps > 5  # two steps of training may well press it


def test_a_dataset_that_lerobot_edited_trains_on_all_that_is_left(
    datasets: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    edit = ["--repo_id=er_il/reach", f"--root={datasets / 'erj'}", "--new_repo_id=er_il/less"]
    edit += [f"--new_root={tmp_path / 'less'}", "--operation.type=delete_episodes", "--operation.episode_indices=[2]"]
    run(monkeypatch, lerobot_edit_dataset.main, *edit)
    assert not (tmp_path / "less/meta/recipe.json").exists()  # LeRobot leaves it behind; nothing here needs it
    command = training(datasets, tmp_path / "out", dataset=tmp_path / "less").command
    assert "--dataset.episodes=[0,1]" in command
    assert '--policy.tags=["er_il:erj/panda/panda_hand_tcp/quat/panda_joint1"]' in command


def test_an_interruption_before_the_first_checkpoint_is_cleared_away(datasets: Path, tmp_path: Path):
    begun = training(datasets, tmp_path / "out")
    (begun.out / "checkpoints" / "000500").mkdir(parents=True)
    begun.prepare()
    assert not begun.out.exists()
    (begun.out / "thesis").mkdir(parents=True)
    with pytest.raises(PolicyError, match="thesis"):
        begun.prepare()
    assert (begun.out / "thesis").exists()


def test_a_checkpoint_cut_off_while_it_was_written_is_not_resumed(datasets: Path, tmp_path: Path):
    begun = training(datasets, tmp_path / "out", steps=9)
    for step in (2, 4):
        state = begun.out / "checkpoints" / f"00000{step}" / "training_state"
        state.mkdir(parents=True)
        (state / "training_step.json").write_text(json.dumps({"step": step}))
    assert begun.done_steps == 2  # the link is missing: the newest may be incomplete
    (begun.out / "checkpoints" / "last").symlink_to("000004")
    assert begun.done_steps == 4


def test_mistakes(datasets: Path, tmp_path: Path):
    with pytest.raises(UnknownNameError, match="joint, task, erj"):
        training(datasets, tmp_path, space="jiont")
    with pytest.raises(DatasetError, match=r"none is not a LeRobot v3 dataset: it has no meta/info\.json"):
        training(datasets, tmp_path, dataset=tmp_path / "none")
    with pytest.raises(DatasetError, match="holds joint actions, not erj"):
        training(datasets, tmp_path, dataset=datasets / "joint")
    with pytest.raises(PolicyError, match="no training configuration"):
        training(datasets, tmp_path, config=tmp_path / "none.yaml")
    with pytest.raises(PolicyError, match="at least one"):
        training(datasets, tmp_path, steps=0)
    with pytest.raises(PolicyError, match="No policy at"):
        pretrained(tmp_path)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["train", "reach_cap", "erj"], "Unknown task 'reach_cap'. Valid: lift_cup, "),
        (["train", "reach_cup", "ejr"], "Unknown action space 'ejr'."),
        (["train", "reach_cup", "erj", "--dataset", "nowhere"], "nowhere is not a LeRobot v3 dataset"),
        (["eval", "nowhere", "--task", "reach_cup", "--decoder", "erj"], "No policy at nowhere"),
    ],
)
def test_the_command_line_answers_mistakes_in_one_line(
    arguments: list[str], complaint: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    with pytest.raises(SystemExit) as left:
        run(monkeypatch, cli.main, *arguments)
    assert left.value.code == 2
    message = capsys.readouterr().err
    assert complaint in message
    assert message.count("\n") == 1
