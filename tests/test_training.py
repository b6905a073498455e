import json
import shutil
import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium
import pytest
import torch
import yaml
from accelerate import Accelerator
from lerobot.datasets import EpisodeAwareSampler, compute_sampler_state
from lerobot.scripts import lerobot_edit_dataset, lerobot_eval, lerobot_train
from rich.progress import Progress
from torch.utils.data import DataLoader

import er_il.policy.in_memory
from er_il import cli
from er_il.datasets.dataset import Dataset
from er_il.datasets.recipe import Recipe
from er_il.datasets.recording import generate
from er_il.envs.tasks import task_id
from er_il.evaluation.rollouts import evaluate
from er_il.policy.configuration import default_config, input_features
from er_il.policy.safeguards import cycle_where_it_was, move_last, save_finite_checkpoint, stop_at_nan
from er_il.policy.training import Training, pretrained
from er_il.support.atomic_files import work_folder
from er_il.support.errors import DatasetError, ErIlError, PolicyError, UnknownNameError


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
    return Training(task="reach_cup", out=out, seed=0, **settings)


def run(monkeypatch: pytest.MonkeyPatch, main: object, *arguments: str) -> None:
    """Run a stock command in this process."""
    monkeypatch.setattr(sys, "argv", ["command", *arguments])
    main()


def run_in_memory(monkeypatch: pytest.MonkeyPatch, training: Training) -> None:
    """Train as ``er-il train`` does, but in this process; test_demo's trainings run in their own."""
    training.prepare()
    with monkeypatch.context() as patch:
        for name, value in list(vars(lerobot_train).items()):
            patch.setattr(lerobot_train, name, value)  # to undo
        run(patch, er_il.policy.in_memory.main, *training.command[1:])


def small_config(folder: Path, **changes: object) -> Path:
    """A policy that takes milliseconds to train, with random numbers in each step; a checkpoint after each."""
    values = yaml.safe_load(default_config("erj").read_text())
    values["policy"] |= {"dim_model": 16, "dim_feedforward": 16, "n_encoder_layers": 1}
    values["policy"] |= {"use_vae": True, "n_vae_encoder_layers": 1, "dropout": 0.1}
    path = folder / "small.yaml"
    path.write_text(yaml.safe_dump(values | {"save_freq": 1} | changes))
    return path


def checkpoint_bytes(training: Training, step: int) -> dict[str, bytes]:
    """What a checkpoint holds of the policy and the training, without what says how it came about."""
    folder = training.out / "checkpoints" / f"{step:06d}"
    files = {str(path.relative_to(folder)): path for path in folder.rglob("*") if path.is_file()}
    told = {"pretrained_model/config.json", "pretrained_model/train_config.json"}
    return {name: path.read_bytes() for name, path in files.items() if name not in told}


def back_to(training: Training, step: int) -> None:
    """Make it as a kill just before the next checkpoint would have left it."""
    folder = training.out / "checkpoints"
    for later in range(step + 1, training.steps + 1):
        shutil.rmtree(folder / f"{later:06d}")
    (folder / "last").unlink()
    (folder / "last").symlink_to(f"{step:06d}")


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
    frames = Dataset(datasets / "erj").episodes[1].stop  # of the two training episodes
    config = small_config(tmp_path, batch_size=frames // 2 + 1)  # two steps an epoch
    longer, in_memory = (training(datasets, tmp_path / name, config=config, steps=4) for name in ("stock", "own"))
    assert (longer.done_steps, longer.finished) == (0, False)
    run(monkeypatch, lerobot_train.main, *longer.command[1:])
    assert (longer.done_steps, longer.finished) == (4, True)
    run_in_memory(monkeypatch, in_memory)
    uninterrupted = checkpoint_bytes(longer, 4)
    assert {"pretrained_model/model.safetensors", "training_state/rng_state.safetensors"} <= uninterrupted.keys()
    assert checkpoint_bytes(in_memory, 4) == uninterrupted
    back_to(in_memory, 3)  # within the second epoch: its order and its random numbers are to go on
    assert (in_memory.done_steps, in_memory.finished) == (3, False)
    assert "--resume=true" in in_memory.command
    shutil.copytree(in_memory.dataset, tmp_path / "dataset")
    in_memory.out.rename(tmp_path / "moved")
    moved = replace(in_memory, out=tmp_path / "moved", dataset=tmp_path / "dataset")  # it goes on where it is now
    run_in_memory(monkeypatch, moved)
    assert checkpoint_bytes(moved, 4) == uninterrupted and not in_memory.out.exists()
    assert json.loads((moved.policy / "train_config.json").read_text())["dataset"]["root"] == str(moved.dataset)

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


def test_one_training_at_a_time(datasets: Path, tmp_path: Path):
    begun = training(datasets, tmp_path / "out")
    with work_folder(begun.out), pytest.raises(ErIlError, match="Another command works in"):
        begun.run()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("loss", "fine"), [(0.1, True), (float("nan"), False), (float("-inf"), False)])
def test_a_loss_that_is_not_finite_ends_the_training(loss: float, fine: bool):
    update = stop_at_nan(lambda tracker: (tracker, None))
    tracker = SimpleNamespace(loss=SimpleNamespace(val=loss), steps=41)
    if fine:
        assert update(tracker) == (tracker, None)
    else:
        with pytest.raises(PolicyError, match=rf"diverged: the loss is {loss} at step 42\."):
            update(tracker)


@pytest.mark.parametrize(
    ("error", "raised"),
    [
        ("value cannot be converted to type float without overflow", PolicyError),
        ("mat1 and mat2 shapes cannot be multiplied", RuntimeError),
    ],
)
def test_a_step_of_the_optimizer_beyond_all_numbers_ends_the_training(error: str, raised: type[Exception]):
    def update(tracker: Any) -> Any:
        raise RuntimeError(error)

    with pytest.raises(raised, match=error):
        stop_at_nan(update)(SimpleNamespace(steps=41))


def test_a_mistake_of_the_training_is_one_line_and_exit_code_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    def diverge() -> None:
        raise PolicyError("The training diverged.")

    for name, value in list(vars(lerobot_train).items()):
        monkeypatch.setattr(lerobot_train, name, value)  # to undo
    monkeypatch.setattr(lerobot_train, "main", diverge)
    with pytest.raises(SystemExit) as left:
        er_il.policy.in_memory.main()
    assert left.value.code == 2
    assert capsys.readouterr().err == "error: The training diverged.\n"


def drawn(state: torch.Tensor, start: int, stop: int) -> list[tuple[list[int], float, torch.Tensor]]:
    """The frames of each step, a random number that it draws, and the generator's state after it."""
    sampler = EpisodeAwareSampler([0], [10], shuffle=True, seed=3)
    torch.set_rng_state(state)
    sampler.load_state_dict(compute_sampler_state(start, 10, 4, 1))
    loader: Any = Accelerator(cpu=True).prepare(DataLoader(range(10), sampler=sampler, batch_size=4))
    batches = islice(cycle_where_it_was(loader), stop - start)
    return [(frames.tolist(), torch.rand(1).item(), torch.get_rng_state()) for frames in batches]


def test_batches_and_random_numbers_go_on_as_without_an_interruption():
    whole = drawn(torch.Generator().manual_seed(0).get_state(), 0, 8)
    assert sorted(chain(*(frames for frames, *_ in whole[3:6]))) == list(range(10))  # three steps an epoch
    assert whole[0][0] != whole[3][0]
    for step in range(1, 8):
        resumed = drawn(whole[step - 1][2], step, 8)
        assert [each[:2] for each in resumed] == [each[:2] for each in whole[step:]]


def test_weights_that_are_no_numbers_are_not_saved(tmp_path: Path):
    policy = torch.nn.Linear(2, 2)
    torch.nn.init.constant_(policy.bias, float("inf"))
    with pytest.raises(PolicyError, match="weights are not finite at step 7"):
        save_finite_checkpoint(step=7, policy=policy, checkpoint_dir=tmp_path / "000007")
    assert list(tmp_path.iterdir()) == []


def test_the_last_checkpoint_is_there_at_any_moment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for step in ("000001", "000002"):
        (tmp_path / step).mkdir()
    move_last(tmp_path / "000001")
    monkeypatch.setattr(Path, "rename", lambda *_: pytest.fail("killed"))
    with pytest.raises(pytest.fail.Exception):
        move_last(tmp_path / "000002")
    monkeypatch.undo()
    assert (tmp_path / "last").readlink() == Path("000001")
    move_last(tmp_path / "000002")
    assert (tmp_path / "last").readlink() == Path("000002")


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
        (["train", "reach_cap", "erj"], "Unknown task 'reach_cap'. Valid: bimanual_press, lift_cup, "),
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
