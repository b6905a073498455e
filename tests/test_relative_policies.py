"""Chunk-relative policies: the steps that convert, trained, saved, loaded and rolled out with the stock commands."""

import json
import sys
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from documented import documented
from lerobot.configs import FeatureType, PolicyFeature
from lerobot.datasets import LeRobotDataset, LeRobotDatasetMetadata
from lerobot.policies import factory
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.act.modeling_act import ACT, ACTPolicy
from lerobot.policies.diffusion.modeling_diffusion import DiffusionPolicy
from lerobot.policies.pi0.configuration_pi0 import PI0Config
from lerobot.policies.smolvla.configuration_smolvla import SmolVLAConfig
from lerobot.processor import PolicyProcessorPipeline, ProcessorStep
from lerobot.processor.converters import policy_action_to_transition, transition_to_policy_action
from lerobot.scripts import lerobot_eval, lerobot_train

import er_il.policy.in_memory
from er_il import Arm, cli
from er_il.datasets.dataset import Dataset
from er_il.datasets.reencoding import reencode
from er_il.datasets.schema import STATE
from er_il.envs.contract import ABSOLUTE_ACTIONS, RELATIVE_ACTIONS
from er_il.envs.tasks import task_id
from er_il.evaluation.rollouts import evaluate
from er_il.policy import chunk_pipelines
from er_il.policy.chunk_pipelines import insert_steps, make_pre_post_processors
from er_il.policy.chunk_steps import AbsoluteActionsStep, RelativeActionsStep
from er_il.policy.configuration import default_config
from er_il.policy.training import Training, pretrained
from er_il.robots.command_line import RobotCommand
from er_il.robots.guard import check
from er_il.spaces.layout import Layout
from er_il.spaces.registry import make_arm_space
from er_il.spaces.relative import RelativeActions
from er_il.support.errors import PolicyError

CHUNK, TAKEN = 20, 10  # actions of a chunk, and of these the policy's, as documented and shipped
PANDA = Arm.preset("panda")
LAYOUT = Layout.of_spaces({"": make_arm_space("rel_erj", PANDA)}, CHUNK)
CONVERT = RelativeActions(LAYOUT, LAYOUT.names)


def run(main: object, *arguments: str) -> None:
    """Run a command in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["command", *arguments])
        main()


@pytest.fixture(scope="module")
def dataset(reach_cup: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return encode(reach_cup / "erj", tmp_path_factory.mktemp("relative") / "rel_erj", "rel_erj")


def encode(source: Path, out: Path, space: str, chunk: int = CHUNK) -> Path:
    reencode(str(source), out, space, rotation="quat", wirings=(), keep=True, chunk=chunk, on_progress=lambda *_: None)
    return out


def steps() -> tuple[RelativeActionsStep, AbsoluteActionsStep]:
    relative = RelativeActionsStep(spec=LAYOUT.spec(), state_names=list(LAYOUT.names))
    return relative, AbsoluteActionsStep(relative_step=relative)


def the_step[S: ProcessorStep](pipeline: PolicyProcessorPipeline[Any, Any], kind: type[S]) -> S:
    """The only step of a kind."""
    (found,) = (step for step in pipeline.steps if isinstance(step, kind))
    return found


def random_states(count: int) -> np.ndarray:
    """States (count, 8) that differ."""
    return np.append(PANDA.home, 1.0) + 0.1 * np.random.default_rng(5).uniform(-1, 1, (count, 8))


def test_every_action_of_a_chunk_counts_from_the_state_at_its_start() -> None:
    network, states = torch.nn.Linear(1, 1), random_states(9)
    relative_step, absolute_step = steps()
    post = PolicyProcessorPipeline(
        [absolute_step], to_transition=policy_action_to_transition, to_output=transition_to_policy_action
    )
    chunk = CONVERT.relative(LAYOUT.encode(random_states(9))[None], states[:1])  # far from zero
    starts = [0, 0, 0, 0, 4, 4, 6, 6, 6]  # a policy's queue is refilled, or was reset, at steps 0, 4 and 6
    for now, start in enumerate(starts):
        relative_step({"observation": {STATE: torch.tensor(states[now : now + 1])}})
        if now == start:
            network(torch.zeros(1, 1))
        action = post(torch.tensor(chunk[:, now]))
        expected = CONVERT.absolute(chunk[:, now : now + 1], states[start : start + 1])[:, 0]
        np.testing.assert_allclose(action, expected, atol=1e-12)
        network(torch.zeros(1, 1))  # what runs between steps, a world model say, is not this policy's prediction
    whole = post(torch.tensor(chunk))  # as real-time chunking has it
    np.testing.assert_allclose(whole, CONVERT.absolute(chunk, states[6:7]), atol=1e-12)


def test_without_a_prediction_there_is_no_action() -> None:
    relative_step, absolute_step = steps()
    state = {"observation": {STATE: torch.tensor(random_states(1))}}
    action: Any = {"action": torch.zeros(1, len(LAYOUT.encoded_names))}
    relative_step(state)
    with pytest.raises(PolicyError, match="no network was seen to run"):
        absolute_step(action)
    relative_step(state)
    torch.nn.Identity()(torch.zeros(1))
    for _ in range(CHUNK):
        absolute_step(action)
        relative_step(state)
    with pytest.raises(PolicyError, match=r"torch\.compile"):
        absolute_step(action)  # no policy of this dataset has chunks of so many actions
    with pytest.raises(PolicyError, match=f"lacks {RELATIVE_ACTIONS}"):
        AbsoluteActionsStep()(action)


def test_a_training_batch_is_relative_to_its_latest_state() -> None:
    relative_step, _ = steps()
    states, actions = random_states(6).reshape(3, 2, 8), np.stack([LAYOUT.encode(random_states(4))] * 3)
    batch: Any = {"observation": {STATE: torch.tensor(states).float()}, "action": torch.tensor(actions).float()}
    out = relative_step(batch)["action"]
    assert isinstance(out, torch.Tensor) and out.dtype == torch.float32
    np.testing.assert_allclose(out, CONVERT.relative(actions, states[:, 1]), atol=1e-5)
    assert batch["action"] is not out and (batch["action"] == torch.tensor(actions).float()).all()


class NoTokenizer(ProcessorStep):
    """In place of LeRobot's, which downloads a vocabulary."""

    def __init__(self, **options: Any) -> None: ...

    def __call__(self, transition: Any) -> Any:
        return transition

    def transform_features(self, features: Any) -> Any:
        return features


@pytest.mark.parametrize("policy_type", ["smolvla", "pi0"])
def test_vision_language_action_policies_get_the_steps(
    policy_type: str, reach_cup: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = encode(reach_cup / "erj", tmp_path / "rel", "rel_erj", chunk=50)
    meta = LeRobotDatasetMetadata("me/rel", root=root)
    config: Any = {"smolvla": SmolVLAConfig, "pi0": PI0Config}[policy_type](device="cpu")
    config.input_features = {STATE: PolicyFeature(FeatureType.STATE, (15,))}
    config.output_features = {"action": PolicyFeature(FeatureType.ACTION, (9,))}
    config._runtime_dataset_meta = meta  # as LeRobot's make_policy does
    module = f"lerobot.policies.{policy_type}.processor_{policy_type}"
    __import__(module)
    monkeypatch.setattr(f"{module}.TokenizerProcessorStep", NoTokenizer)
    pre, post = make_pre_post_processors(config, dataset_stats=meta.stats)
    frames = LeRobotDataset("me/rel", root=root, delta_timestamps={"action": [i / 20 for i in range(50)]})
    batch = torch.utils.data.default_collate([frames[3], frames[40]])
    seen = pre(batch)
    of_dataset = RelativeActions(Dataset(root).layout, Dataset(root).names(STATE))
    relative = of_dataset.relative(batch["action"].numpy(), batch[STATE].numpy())
    assert meta.stats
    mean, deviation = (np.asarray(meta.stats["action"][name]) for name in ("mean", "std"))
    np.testing.assert_allclose(seen["action"], (relative - mean) / deviation, atol=1e-3)
    assert seen["action"].abs().max() < 10  # of the chunks' own statistics
    pre({STATE: batch[STATE], "task": ["Reach."] * 2})
    torch.nn.Identity()(batch[STATE])
    np.testing.assert_allclose(post(seen["action"]), batch["action"], atol=1e-4)


def config_of(root: Path, **changes: Any) -> ACTConfig:
    settings: dict[str, Any] = {"chunk_size": CHUNK, "n_action_steps": 5} | changes
    config = ACTConfig(device="cpu", **settings)
    config._runtime_dataset_meta = LeRobotDatasetMetadata("me/rel", root=root)
    return config


def test_settings_that_cannot_act_chunk_relative_are_refused(dataset: Path, reach_cup: Path) -> None:
    pre, _ = make_pre_post_processors(config_of(dataset))
    names = [type(step).__name__ for step in pre.steps]
    assert names.index("RelativeActionsStep") < names.index("NormalizerProcessorStep")
    with pytest.raises(PolicyError, match=r"have 30 actions, but .* of 20: encode it again with --chunk 30"):
        make_pre_post_processors(config_of(dataset, chunk_size=30))
    with pytest.raises(PolicyError, match=r"--policy\.temporal_ensemble_coeff=null"):
        make_pre_post_processors(config_of(dataset, n_action_steps=1, temporal_ensemble_coeff=0.01))
    with pytest.raises(PolicyError, match="Policies of the type xvla normalise actions in their own way"):
        insert_steps("xvla", pre, SimpleNamespace(steps=[]), LAYOUT.spec(), LAYOUT.names)
    plain = config_of(reach_cup / "erj", n_action_steps=1, temporal_ensemble_coeff=0.01)
    assert not any(isinstance(step, RelativeActionsStep) for step in make_pre_post_processors(plain)[0].steps)


@pytest.fixture(scope="module")
def trained(reach_cup: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """An ACT policy, trained for two steps by the documented commands, which were interrupted after the first."""
    folder = tmp_path_factory.mktemp("documented")
    (folder / "datasets/reach_cup").mkdir(parents=True)
    (folder / "datasets/reach_cup/erj").symlink_to(reach_cup / "erj")
    options = ["--policy.device=cpu", "--num_workers=0", "--batch_size=2", "--steps=1", "--policy.dim_model=16"]
    options += ["--policy.dim_feedforward=16", "--policy.n_heads=2", "--policy.n_encoder_layers=1"]
    options += [
        "--policy.use_vae=false",
        "--policy.normalization_mapping={STATE: IDENTITY, ENV: MIN_MAX, ACTION: IDENTITY}",
    ]
    with chdir(folder):  # where the policy says that its dataset is
        run(cli.main, *documented("docs/policies.md", "er-il encode"))
        chunk_pipelines.install()  # as the plugin does when LeRobot imports it; other tests undo it
        run(lerobot_train.main, *documented("docs/policies.md", "lerobot-train"), *options)
        policy = pretrained(Path("policies/reach_cup/rel_erj"))
        run(lerobot_train.main, f"--config_path={policy / 'train_config.json'}", "--resume=true", "--steps=2")
        yield policy


def test_the_steps_are_saved_and_loaded_by_lerobot_itself(trained: Path) -> None:
    saved = {
        name: [
            step["registry_name"]
            for step in json.loads((trained / f"policy_{name}processor.json").read_text())["steps"]
        ]
        for name in ("pre", "post")
    }
    assert saved["pre"].count(RELATIVE_ACTIONS) == saved["post"].count(ABSOLUTE_ACTIONS) == 1  # also after a resume
    config = ACTConfig.from_pretrained(trained)
    pre, post = chunk_pipelines._STOCK(config, pretrained_path=str(trained))
    assert the_step(post, AbsoluteActionsStep).relative_step is the_step(pre, RelativeActionsStep)
    config.n_action_steps, config.temporal_ensemble_coeff = 1, 0.01
    assert factory.make_pre_post_processors is make_pre_post_processors
    with pytest.raises(PolicyError, match="averages actions of several chunks"):
        factory.make_pre_post_processors(config, pretrained_path=str(trained))


def test_fine_tuning_on_other_actions_is_refused(trained: Path, dataset: Path, reach_cup: Path) -> None:
    pre, _ = make_pre_post_processors(config_of(dataset), pretrained_path=str(trained))
    assert the_step(pre, RelativeActionsStep).convert.layout.chunk == CHUNK
    with pytest.raises(PolicyError, match="trained for other chunk-relative actions than the dataset's"):
        make_pre_post_processors(config_of(reach_cup / "erj"), pretrained_path=str(trained))


def leader_actions(seed: int) -> np.ndarray:
    """The demonstration (T, 9) of a seed's world in ERJ."""
    env = gymnasium.make(task_id("reach_cup"))
    env.reset(seed=seed)
    return LAYOUT.encode(np.array(list(env.unwrapped.leader(seed))))


@pytest.fixture
def network_that_knows(monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """Let ACT's network predict each chunk of given actions (T, 9), relative to the state that it sees."""
    known: list[np.ndarray] = []
    predicted = 0  # actions since the policy's last reset
    stock = ACTPolicy.reset

    def reset(policy: ACTPolicy) -> None:
        nonlocal predicted
        stock(policy)
        predicted = 0

    def forward(network: ACT, batch: dict[str, torch.Tensor]) -> tuple[torch.Tensor, tuple[None, None]]:
        nonlocal predicted
        rows = batch[STATE].double().numpy()
        ahead = known[0][np.minimum(predicted + np.arange(CHUNK), len(known[0]) - 1)]
        predicted += TAKEN
        chunks = CONVERT.relative(np.stack([ahead] * len(rows)), rows[:, :8])
        return torch.from_numpy(chunks).float(), (None, None)

    monkeypatch.setattr(ACT, "forward", forward)
    monkeypatch.setattr(ACTPolicy, "reset", reset)
    return known


@pytest.mark.slow
def test_a_demonstration_predicted_chunk_by_chunk_reaches_the_cup(
    trained: Path, network_that_knows: list[np.ndarray], tmp_path: Path
) -> None:
    """The network says what the demonstration says, relative to the state it sees; all else is the real thing."""
    network_that_knows.append(leader_actions(7))
    (rollout,) = evaluate(trained, "reach_cup", "rel_erj", episodes=1, seed=7)
    assert rollout.success
    stock = ["--eval.n_episodes=1", "--eval.batch_size=1", "--eval.use_async_envs=false", "--eval.recording=true"]
    stock += ["--seed=7", f"--output_dir={tmp_path / 'eval'}"]
    run(lerobot_eval.main, *documented("docs/policies.md", "lerobot-eval"), *stock)
    assert json.loads((tmp_path / "eval/eval_info.json").read_text())["overall"]["pc_success"] == 100.0
    with pytest.raises(PolicyError, match="space 'rel_erj' not 'erj'"):
        evaluate(trained, "reach_cup", "erj", episodes=1)


@pytest.mark.slow
@pytest.mark.usefixtures("quiet_logging")
def test_real_time_chunking_and_policy_servers_are_refused(trained: Path) -> None:
    check(RobotCommand(robot="er_il_arm", policy=str(trained)))
    with pytest.raises(PolicyError, match="Real-time chunking joins chunks"):
        check(RobotCommand(robot="er_il_arm", policy=str(trained), inference="rtc"))
    with pytest.raises(PolicyError, match="policy server loads no plugins"):
        check(RobotCommand(robot="er_il_arm", policy=str(trained), served=True))
    with pytest.raises(PolicyError, match="trained in rel_erj action space; so101_follower would take"):
        check(RobotCommand(robot="so101_follower", policy=str(trained)))


@pytest.mark.slow
def test_diffusion_trains_and_its_chunks_count_from_where_they_were_predicted(
    dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = default_config("erj").with_name("diffusion.yaml")
    training = Training("reach_cup", "rel_erj", dataset, tmp_path / "out", config, 2, 0)
    with monkeypatch.context() as patch:
        for name, value in list(vars(lerobot_train).items()):
            patch.setattr(lerobot_train, name, value)  # to undo
        training.prepare()
        run(er_il.policy.in_memory.main, *training.command[1:], "--batch_size=4", "--policy.num_inference_steps=2")
    path = pretrained(training.out)
    policy = DiffusionPolicy.from_pretrained(path)
    policy.eval()
    pre, post = factory.make_pre_post_processors(policy.config, pretrained_path=str(path))
    relative = the_step(pre, RelativeActionsStep)
    states, poses = Dataset(dataset).vectors(STATE)[:10], torch.zeros(1, 7)
    taken, anchors = policy.config.n_action_steps, []
    for state in states:
        seen = pre({STATE: torch.tensor(state)[None], "observation.environment_state": poses})
        with torch.inference_mode():
            assert post(policy.select_action(seen)).shape == (1, 9)
        anchors.append(int(np.abs(states - relative.anchor).sum(axis=1).argmin()))
    assert anchors == [0] * taken + [taken] * (10 - taken)  # though it sees each observation, and two at once
    (rollout,) = evaluate(path, "reach_cup", "rel_erj", episodes=1, batch_size=1)
    assert rollout.steps > 1
