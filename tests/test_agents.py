"""Agents: training, resuming, evaluation, and their use as LeRobot policies and as demonstrators."""

import json
import shutil
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from acting import MODE, SMALL, TASK, homing_agent
from documented import documented, train_in_process
from documented import run as documented_run
from gymnasium.spaces import Box
from lerobot.datasets import LeRobotDataset
from lerobot.scripts import lerobot_eval
from safetensors.torch import load_file
from stable_baselines3 import SAC
from stable_baselines3.common.buffers import NStepReplayBuffer, ReplayBufferSamples
from stable_baselines3.common.vec_env import DummyVecEnv

from er_il.cli import main
from er_il.datasets.dataset import Dataset
from er_il.datasets.recipe import Recipe
from er_il.datasets.record import read_episodes
from er_il.envs import make_rl_env
from er_il.evaluation.trace import Trace
from er_il.rl.assessment import environment_of
from er_il.rl.checkpoint import POLICY, STATE, last_checkpoint, load_state
from er_il.rl.controller import ControllerView
from er_il.rl.demonstrator import AgentDemonstrator
from er_il.rl.evaluation import roll_out
from er_il.rl.learner import aim, make_sac
from er_il.rl.loading import load_agent
from er_il.rl.pixels import shifted
from er_il.rl.scaling import state_scale
from er_il.rl.settings import Settings, SettingsError
from er_il.rl.training import AgentTraining
from er_il.robots.command_line import RobotCommand
from er_il.robots.guard import check
from er_il.support.errors import PolicyError, UnknownNameError

STEPS = 128


def training(out: Path, **changes: object) -> AgentTraining:
    return replace(AgentTraining(TASK, MODE, STEPS, 0, SMALL, out), **changes)


def weights(of: AgentTraining) -> dict[str, torch.Tensor]:
    last = last_checkpoint(of.out)
    assert last is not None
    return load_file(last / POLICY / "model.safetensors")


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> AgentTraining:
    done = training(tmp_path_factory.mktemp("agent") / "rl_task")
    assert [each.steps for each in done.run()] == [64, 128]
    return done


@pytest.fixture(scope="module")
def homing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("homing") / "agent"
    homing_agent(folder)
    return folder


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> None:
    monkeypatch.setattr("sys.argv", ["er-il", *arguments])
    main()


def test_equal_trainings_give_equal_agents_and_another_seed_another_one(trained: AgentTraining, tmp_path: Path) -> None:
    assert trained.finished
    again, other = training(tmp_path / "again"), training(tmp_path / "other", seed=1)
    assert again.run() == trained.milestones
    other.run()
    assert all(torch.equal(value, weights(again)[key]) for key, value in weights(trained).items())
    assert any(not torch.equal(value, weights(other)[key]) for key, value in weights(trained).items())


def test_an_interrupted_training_goes_on_from_its_checkpoint(trained: AgentTraining, tmp_path: Path) -> None:
    whole = training(tmp_path / "agent")
    seen: list[int] = []

    def stop(steps: int, _: str) -> None:
        seen.append(steps)
        if steps == 100:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        whole.run(stop)
    assert not whole.finished and [each.steps for each in whole.milestones] == [64]
    seen.clear()
    assert [each.steps for each in whole.run(lambda steps, _: seen.append(steps))] == [64, 128]
    assert seen[0] == 66  # what was learnt before the checkpoint is not learnt again
    assert whole.milestones == trained.milestones  # as if nothing had happened
    assert all(torch.equal(value, weights(whole)[key]) for key, value in weights(trained).items())
    assert whole.run() == whole.milestones  # done: nothing is left to do
    assert [each.steps for each in replace(whole, steps=130).run()] == [64, 128, 130]


def test_after_a_training_torch_checks_its_distributions_again(trained: AgentTraining) -> None:
    assert trained.finished
    with pytest.raises(ValueError, match="constraint"):
        torch.distributions.Normal(0.0, -1.0)


def test_networks_see_what_is_left_to_a_goal_ten_times_as_large(trained: AgentTraining) -> None:
    names = trained.make_env().observation_names
    scale = weights(trained)["actor.features_extractor.scale"]  # comes with the weights of the policy
    small = [name.endswith((".dx", ".dy", ".dz", ".left")) for name in names]
    assert scale.tolist() == [10.0 if each else 1.0 for each in small] and sum(small) > 7
    shares = ControllerView(names).inputs[-6:]
    assert state_scale(shares) == [1.0] * 6  # shares of the largest changes are large already


def test_a_checkpoint_brings_everything_back(trained: AgentTraining) -> None:
    fresh = untrained(trained, seed=7)
    folder = last_checkpoint(trained.out)
    assert folder is not None
    progress = load_state(folder / STATE, {"task": fresh})
    assert [each["steps"] for each in progress["milestones"]] == [64, 128]
    assert (fresh.num_timesteps, fresh._n_updates) == (STEPS, (STEPS - SMALL.warm_up) // 2 * SMALL.updates)
    buffer = fresh.replay_buffer
    assert buffer is not None and buffer.size() == STEPS // 2
    assert np.abs(buffer.observations[: buffer.pos]).max() > 0.1 and not buffer.observations[buffer.pos :].any()
    assert all(torch.equal(value, weights(trained)[f"actor.{key}"]) for key, value in fresh.actor.state_dict().items())
    moments = fresh.critic.optimizer.state_dict()["state"]
    assert moments and all(each["step"] == fresh._n_updates for each in moments.values())


def untrained(training: AgentTraining, seed: int) -> SAC:
    """SAC as a training begins with it; its environments are closed."""
    envs = DummyVecEnv([training.make_env] * SMALL.environments)
    with closing(envs), closing(training.make_env()) as probe:
        return make_sac(envs, probe.observation_names, SMALL, seed)


def test_the_entropy_aimed_at_changes_along_a_training(
    trained: AgentTraining, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    learner, settings = untrained(trained, seed=0), Settings(**SMALL.to_dict() | {"entropy": (-0.5, -2.5)})
    dimension = len(trained.make_env().action_names)
    for progress, of_a_dimension in ((0.0, -0.5), (0.5, -0.5), (0.75, -1.5), (1.0, -2.5)):
        aim(learner, settings, progress)
        assert learner.target_entropy == pytest.approx(dimension * of_a_dimension)
    seen: list[tuple[SAC, float]] = []
    monkeypatch.setattr("er_il.rl.training.aim", lambda learner, _, progress: seen.append((learner, progress)))
    training(tmp_path / "both", mode="jailer").run()
    learners = {learner for learner, _ in seen}
    assert len(learners) == 2  # the controller's, too
    for learner in learners:
        assert [progress for each, progress in seen if each is learner] == [step / STEPS for step in range(0, STEPS, 2)]


def test_no_return_reaches_beyond_a_checkpoint_into_the_next_episode(trained: AgentTraining) -> None:
    learner = untrained(trained, seed=0)
    folder = last_checkpoint(trained.out)
    assert folder is not None and SMALL.n_steps == 3
    load_state(folder / STATE, {"task": learner})
    buffer = learner.replay_buffer
    assert isinstance(buffer, NStepReplayBuffer)
    last = SMALL.milestone // SMALL.environments - 1  # decisions of each environment before the checkpoint
    assert (buffer.dones[last] == 0).all()  # nothing ended there but by the checkpoint
    discount = SMALL.discount
    assert all(sample.discounts.item() == pytest.approx(discount) for sample in drawn(buffer, last))
    assert all(sample.dones.item() == 0 for sample in drawn(buffer, last))  # the critic is asked beyond it
    assert all(sample.discounts.item() == pytest.approx(discount**2) for sample in drawn(buffer, last - 1))


def test_episodes_to_learn_from_are_shorter_than_those_to_be_judged(tmp_path: Path) -> None:
    short = replace(training(tmp_path / "agent"), settings=SMALL.replaced(episode=5))
    short.run()
    folder, learner = last_checkpoint(short.out), untrained(short, seed=0)
    assert folder is not None
    load_state(folder / STATE, {"task": learner})
    buffer = learner.replay_buffer
    assert buffer is not None
    ends = np.arange(4, SMALL.milestone // SMALL.environments, 5)
    assert buffer.dones[ends].all() and buffer.timeouts[ends].all()  # the critic is asked what would follow
    with closing(short.make_env()) as judged:
        judged.reset(seed=0)
        assert not any(judged.step(np.zeros(7, np.float32))[3] for _ in range(10))


def drawn(buffer: NStepReplayBuffer, row: int) -> list[ReplayBufferSamples]:
    return [buffer._get_samples(np.array([row])) for _ in range(10)]


def test_critics_do_not_grow_where_no_data_is(trained: AgentTraining) -> None:
    learner = untrained(trained, seed=0)
    assert isinstance(learner.observation_space, Box) and isinstance(learner.action_space, Box)
    far = torch.randn(4, *learner.observation_space.shape)
    action = torch.zeros(4, *learner.action_space.shape)
    with torch.no_grad():
        near, beyond = (torch.cat(learner.critic(scale * far, action)) for scale in (100.0, 10_000.0))
    assert (beyond - near).abs().max() < 0.1 * near.abs().max()  # not a hundred times as large


def test_a_folder_belongs_to_one_training(trained: AgentTraining, tmp_path: Path) -> None:
    with pytest.raises(PolicyError, match=r"another training; asked for is \{'mode': 'joint'\} instead of"):
        replace(trained, mode="joint").run()
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(PolicyError, match="something else than an agent"):
        training(tmp_path).run()
    with pytest.raises(UnknownNameError, match="Unknown mode 'osc'"):
        training(tmp_path / "new", mode="osc").run()
    with pytest.raises(SettingsError, match="holds no batch"):
        SMALL.replaced(buffer=8)
    with pytest.raises(SettingsError, match="learning_rat"):
        Settings.from_dict(SMALL.to_dict() | {"learning_rat": 1.0})
    for value in (float("nan"), -float("inf")):
        with pytest.raises(SettingsError, match=r"entropy\.0 is .*: Input should be a finite number"):
            SMALL.replaced(entropy=(value, -1.0))


@pytest.mark.parametrize("name", ["task.pt", "task.npz", "progress.json", "random.pt"])
def test_a_damaged_checkpoint_is_told_in_one_line(trained: AgentTraining, tmp_path: Path, name: str) -> None:
    copy = tmp_path / "agent"
    shutil.copytree(trained.out, copy, symlinks=True)
    folder = last_checkpoint(copy)
    assert folder is not None
    file = folder / STATE / name
    file.write_bytes(file.read_bytes()[:100])
    with pytest.raises(PolicyError, match="damaged"):
        replace(trained, out=copy, steps=STEPS + 2).run()


def test_an_agent_is_evaluated_on_fixed_starts(homing: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(monkeypatch, "rl", "eval", str(homing), "--episodes", "3", "--films", "1", "--out", str(tmp_path))
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["cells"][0] | {"successes": 3, "episodes": 3, "task": TASK, "mode": MODE} == report["cells"][0]
    assert report["meta"]["first_seed"] == 1000
    trace = Trace.load(tmp_path / "episode_1000.npz")
    assert (trace.outcome, trace.period) == ("success", 0.1)
    assert np.abs(trace.action[:, :3]).max() == pytest.approx(0.05, rel=1e-3)  # in metres
    assert (tmp_path / "episode_1000.mp4").stat().st_size > 1000 and (tmp_path / "episode_1000.rrd").exists()
    agent = load_agent(homing)
    env = environment_of(agent)
    together, alone = roll_out(agent.act, env, [1001, 1002]), roll_out(agent.act, env, [1002])
    assert together[1].steps == alone[0].steps and together[1].success
    env.close()


@pytest.mark.slow
def test_lerobot_evaluates_an_agent(homing: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arguments = ["--env.type=er_il_rl", f"--env.task={TASK}", f"--policy.path={homing}", "--eval.n_episodes=2"]
    arguments += ["--eval.batch_size=2", "--eval.use_async_envs=false", "--eval.recording=true"]
    monkeypatch.setattr("sys.argv", ["lerobot-eval", *arguments, "--env.mode=task", f"--output_dir={tmp_path}"])
    lerobot_eval.main()
    assert json.loads((tmp_path / "eval_info.json").read_text())["overall"]["pc_success"] == 100
    monkeypatch.setattr("sys.argv", ["lerobot-eval", *arguments, "--env.mode=erj", f"--output_dir={tmp_path / 'no'}"])
    with pytest.raises(PolicyError, match=r"--env\.mode=task"):
        lerobot_eval.main()


def test_agents_are_no_policies_of_robots(homing: Path) -> None:
    with pytest.raises(PolicyError, match="er-il generate TASK --agent"):
        check(RobotCommand(robot="so100_follower", policy=str(homing)))


@pytest.mark.slow
@pytest.mark.usefixtures("one_worker", "quiet_logging")
def test_an_agents_rollouts_become_datasets_and_these_policies(
    homing: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(homing, "policies/reach_target/rl_task")
    documented_run("er-il", *documented("docs/reinforcement_learning.md", "er-il generate"), "--episodes", "2")
    train_in_process(monkeypatch, "--batch_size=2")
    documented_run("er-il", *documented("docs/reinforcement_learning.md", "er-il train"), "--steps", "2")
    out = tmp_path / "datasets/by_agent"
    dataset = Dataset(out / "erj")
    assert (dataset.info["fps"], dataset.info["total_episodes"]) == (10, 2)
    assert LeRobotDataset("er_il/again", out / "joint").num_frames == dataset.info["total_frames"]
    demonstrator = AgentDemonstrator(homing)
    commands = read_episodes(out / "joint")[0].leader
    world = make_rl_env(TASK, MODE).world  # commanded as recorded, the arm does it again
    seed = read_episodes(out / "joint")[0].seed
    world.reset(seed=seed, options={"beyond_success": True})
    ends = [world.step(command)[4]["is_success"] for command in commands]
    assert ends[-1]
    with pytest.raises(PolicyError, match="task reach_target, not stack_wine"):
        demonstrator.recipe(Recipe.load("stack_wine"))


@pytest.mark.slow
def test_learning_from_images(tmp_path: Path) -> None:
    settings = SMALL.replaced(shift=4, milestone=48, batch_size=4, buffer=200, warm_up=8, n_steps=1)
    with pytest.raises(SettingsError, match="n_steps must be 1"):
        training(tmp_path / "several", pixels=True, settings=settings.replaced(n_steps=3)).run()
    seeing = training(tmp_path / "agent", mode="erj", pixels=True, steps=48, settings=settings)
    assert [each.steps for each in seeing.run()] == [48]
    agent = load_agent(seeing.out)
    assert agent.cameras == ("wrist", "front")
    env = environment_of(agent)
    observation, _ = env.reset(seed=3)
    other = observation | {"front": 255 - observation["front"]}
    assert not np.array_equal(agent.act(observation), agent.act(other))
    env.close()


def test_images_are_shifted_and_their_borders_repeated() -> None:
    torch.manual_seed(0)
    image = torch.arange(25.0).reshape(1, 1, 5, 5).expand(64, 2, 5, 5)
    moved = shifted(image, 1)
    assert moved.shape == image.shape
    places = {tuple(each[0, 2, 2:3].tolist()) for each in moved}
    assert places == {(value,) for row in (1, 2, 3) for value in (5.0 * row + 1, 5.0 * row + 2, 5.0 * row + 3)}
    assert torch.equal(moved[:, 0], moved[:, 1])  # the channels of an image move together
    up = next(each[0] for each in moved if each[0, 2, 2] == 17.0)  # seen from one row below
    assert torch.equal(up[:4], image[0, 0, 1:]) and torch.equal(up[4], image[0, 0, 4])


def test_the_state_that_an_agent_saw_is_that_of_its_environment() -> None:
    env = make_rl_env(TASK, MODE)
    env.reset(seed=5)
    change = env.change(np.array([1, -1, 0.5, 0, 0, 2, -0.1], dtype=np.float32))
    assert change.tolist() == pytest.approx([0.05, -0.05, 0.025, 0, 0, 0.05, 0.45])
    assert env.seen["agent_pos"][: env.world.arm.dof] == pytest.approx(env.world.joint_positions, abs=1e-6)
    env.close()
