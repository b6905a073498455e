"""The stock commands for robots, on the simulated follower and the scripted leader."""

import json
import logging
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path

import draccus
import gymnasium
import numpy as np
import pytest
import torch
from documented import documented
from lerobot.datasets import LeRobotDataset
from lerobot.policies.act.modeling_act import ACT, ACTPolicy
from lerobot.robots import RobotConfig, make_robot_from_config
from lerobot.scripts import lerobot_record, lerobot_replay, lerobot_rollout, lerobot_teleoperate, lerobot_train
from lerobot.teleoperators import TeleoperatorConfig, make_teleoperator_from_config
from lerobot.utils.import_utils import register_third_party_plugins
from operating import EPISODE_TIME, interrupted_after, right_arrow_after

from er_il import cli
from er_il.envs.contract import check_policy
from er_il.envs.lerobot_plugin import ErIlEnvConfig
from er_il.envs.tasks import task_id
from er_il.policy import chunk_pipelines
from er_il.robots.hardware import ScriptedLeader, ScriptedLeaderConfig, SimFollower, SimFollowerConfig
from er_il.spaces.layout import Layout
from er_il.spaces.relative import RelativeActions
from er_il.spaces.spec import ACTION
from er_il.support.errors import ErIlError, PolicyError, UnknownNameError

pytestmark = pytest.mark.usefixtures("quiet_logging")

SEED = 7
SIZE = 32
ROBOT = ["--robot.type=er_il_sim", f"--robot.seed={SEED}", f"--robot.image_size={SIZE}"]
# Its world's rate, not the one at which it is recorded, limits the joints' velocities.
DECODING = ["--robot.type=er_il_arm", "--robot.fps=20", *(each.replace("robot.", "robot.inner.") for each in ROBOT)]
LEADER = ["--teleop.type=er_il_scripted_leader", f"--teleop.seed={SEED}"]
STEPS = 60  # of each recorded episode
RATE = 60  # [Hz] the simulated world takes its own time, 20 Hz: here three times as fast as life
CHUNK = 20  # actions at a time from the policy server, as documented
NAMES = [*(f"panda_joint{i}.pos" for i in range(1, 8)), "gripper.pos"]
TINY = ["dim_model=32", "dim_feedforward=32", "n_heads=2", "n_encoder_layers=1", "use_vae=false"]


def run(main: object, *arguments: str) -> None:
    """Run a command in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["command", *arguments])
        main()


def script(seed: int) -> np.ndarray:
    """The demonstration (T, 8) [rad] of a seed's world."""
    env = gymnasium.make(task_id("reach_cup"))
    env.reset(seed=seed)
    world = env.unwrapped
    return np.array(list(world.leader(seed)))


def sent_to_followers(monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """What simulated followers are told from now on (8,) [deg]."""
    sent, send = [], SimFollower.send_action

    def kept(robot: SimFollower, action: dict[str, float]) -> dict[str, float]:
        sent.append(np.array([action[name] for name in NAMES]))
        return send(robot, action)

    monkeypatch.setattr(SimFollower, "send_action", kept)
    return sent


def encoded_demonstration(policy: Path) -> tuple[np.ndarray, torch.Tensor]:
    """The demonstration (T, 8) [deg], and as the policy's actions (T, 9)."""
    spec = json.loads((policy.with_name("erj") / "meta/info.json").read_text())["features"][ACTION]["info"]["er_il"]
    demonstration = in_degrees(script(SEED))
    return demonstration, torch.from_numpy(Layout.from_spec(spec).encode(demonstration).astype(np.float32))


def chunk_at(actions: torch.Tensor, step: int) -> torch.Tensor:
    """The chunk of actions (1, CHUNK, 9) from a step on; the last one goes on."""
    return torch.cat([actions[step:], actions[-1:].expand(CHUNK, -1)])[None, :CHUNK]


def check_demonstrated(sent: np.ndarray, demonstration: np.ndarray) -> None:
    """Check that nothing but a demonstration was commanded, and its first half.

    By clocks and threads LeRobot may send an action twice or leave some out, after which the arm catches up: actions
    are not compared by their number.
    """
    errors = np.abs(sent[:, None] - demonstration).max(axis=-1)  # [deg]
    assert np.quantile(errors.min(axis=1), 0.9) < 0.1
    assert np.quantile(errors.min(axis=0)[: len(demonstration) // 2], 0.9) < 0.1


def in_degrees(script: np.ndarray) -> np.ndarray:
    return np.column_stack([np.degrees(script[:, :-1]), script[:, -1]])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("recorded") / "data"
    dataset = ["--dataset.repo_id=me/reach", f"--dataset.root={root}", "--dataset.single_task=Reach the cup."]
    dataset += [f"--dataset.fps={RATE}", "--dataset.num_episodes=2", f"--dataset.episode_time_s={EPISODE_TIME}"]
    dataset += ["--dataset.reset_time_s=0.1", "--dataset.push_to_hub=false", "--play_sounds=false"]
    with right_arrow_after(STEPS):
        run(lerobot_record.main, *ROBOT, *LEADER, *dataset)
    return root


@pytest.fixture(scope="module")
def policy(recorded: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An ERJ policy, trained for two steps on what was recorded."""
    folder = tmp_path_factory.mktemp("policy")
    encode = ["encode", str(recorded), "--to", "erj", "--arm", "panda", "--units", "deg"]
    run(cli.main, *encode, "--out", str(folder / "erj"))
    train = ["--policy.type=act", "--policy.device=cpu", "--policy.push_to_hub=false", "--num_workers=0"]
    train += ["--policy.pretrained_backbone_weights=null", *(f"--policy.{option}" for option in TINY)]
    train += ["--policy.chunk_size=4", "--policy.n_action_steps=1", "--policy.temporal_ensemble_coeff=0.01"]
    train += ["--policy.normalization_mapping={VISUAL: MEAN_STD, STATE: MIN_MAX, ACTION: IDENTITY}"]
    train += ["--dataset.repo_id=me/reach_erj", f"--dataset.root={folder / 'erj'}", "--dataset.video_backend=pyav"]
    run(lerobot_train.main, *train, f"--output_dir={folder / 'out'}", "--steps=2", "--batch_size=2")
    return folder / "out"


@pytest.fixture(scope="module")
def attached(policy: Path) -> Path:
    out = policy.with_name("attached")
    run(cli.main, "attach", str(policy), "--out", str(out), "--fps", "20")
    return out


@pytest.mark.slow
def test_stock_record_gives_a_dataset_of_the_scripts_in_degrees(recorded: Path):
    dataset = LeRobotDataset("me/reach", root=recorded, video_backend="pyav")
    assert dataset.num_episodes == 2
    assert dataset.features[ACTION]["names"] == dataset.features["observation.state"]["names"] == NAMES
    assert dataset.features["observation.images.wrist"]["shape"] == (SIZE, SIZE, 3)
    columns = dataset.hf_dataset.with_format("numpy")
    for episode in range(2):
        rows = columns[:]["episode_index"] == episode
        action, state = columns[:][ACTION][rows], columns[:]["observation.state"][rows]
        expected = in_degrees(script(SEED + episode))  # another world each episode, from its beginning
        assert len(action) == STEPS
        np.testing.assert_allclose(action, expected[:STEPS], atol=1e-4)
        np.testing.assert_allclose(state[1:, :7], action[:-1, :7], atol=3.0)  # servos lag
    assert dataset[0]["observation.images.wrist"].std() > 0.01


@pytest.mark.slow
def test_an_erj_policy_drives_the_robot_to_the_cup_through_the_stock_rollout(
    attached: Path, recorded: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    """The network says what the demonstration says; all that follows on it is the real thing."""
    encoded = LeRobotDataset("me/reach_erj", root=attached.with_name("erj"), video_backend="pyav")
    spec = encoded.features[ACTION]["info"]["er_il"]
    actions = Layout.from_spec(spec).encode(in_degrees(script(SEED)))
    said = iter(torch.from_numpy(actions.astype(np.float32)))
    say = interrupted_after(len(actions), lambda policy, batch: next(said)[None])
    monkeypatch.setattr(ACTPolicy, "select_action", say)
    run(lerobot_rollout.main, f"--policy.path={attached}", *ROBOT, "--fps=100",
        "--task=Reach the cup.", "--return_to_initial_position=false")  # fmt: skip
    assert "Simulated episode 0: success" in capfd.readouterr().err


@pytest.mark.slow
def test_the_same_policy_unattached_drives_the_robot_that_decodes(
    policy: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    """The policy alone says what its actions mean; at the end LeRobot brings the arm back by its joints."""
    demonstration, actions = encoded_demonstration(policy)
    said = iter(actions)
    say = interrupted_after(len(demonstration), lambda policy, batch: next(said)[None])
    monkeypatch.setattr(ACTPolicy, "select_action", say)
    sent = sent_to_followers(monkeypatch)
    trained = policy / "checkpoints/last/pretrained_model"
    run(lerobot_rollout.main, f"--policy.path={trained}", *DECODING, "--fps=100", "--task=Reach the cup.")  # fmt: skip
    assert "Simulated episode 0: success" in capfd.readouterr().err
    np.testing.assert_allclose(sent[: len(demonstration)], demonstration, atol=0.1)
    np.testing.assert_allclose(sent[-1][:7], demonstration[0][:7], atol=1.0)  # back where it started


@pytest.fixture(scope="module")
def relative(recorded: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A chunk-relative ERJ policy, trained for a step on what was recorded."""
    folder = tmp_path_factory.mktemp("relative")
    encode = ["encode", str(recorded), "--to", "rel_erj", "--chunk", "4", "--arm", "panda", "--units", "deg"]
    run(cli.main, *encode, "--out", str(folder / "erj"))
    train = ["--policy.type=act", "--policy.device=cpu", "--policy.push_to_hub=false", "--num_workers=0"]
    train += ["--policy.pretrained_backbone_weights=null", *(f"--policy.{option}" for option in TINY)]
    train += ["--policy.chunk_size=4", "--policy.n_action_steps=4"]
    train += ["--policy.normalization_mapping={VISUAL: MEAN_STD, STATE: IDENTITY, ACTION: IDENTITY}"]
    train += ["--dataset.repo_id=me/reach_erj", f"--dataset.root={folder / 'erj'}", "--dataset.video_backend=pyav"]
    register_third_party_plugins()
    chunk_pipelines.install()  # other tests of this process undo it
    run(lerobot_train.main, *train, f"--output_dir={folder / 'out'}", "--steps=1", "--batch_size=2")
    return folder / "out"


@pytest.mark.slow
@pytest.mark.parametrize("decoder", ["robot", "policy"])
def test_a_chunk_relative_policy_drives_the_robot(
    decoder: str, relative: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    """The network says what the demonstration says, four actions at a time, relative to the joints that it sees."""
    demonstration, actions = encoded_demonstration(relative)
    spec = json.loads((relative.with_name("erj") / "meta/info.json").read_text())["features"][ACTION]["info"]["er_il"]
    convert = RelativeActions(Layout.from_spec(spec), tuple(NAMES))
    said = count(step=4)

    def predict(network: ACT, batch: dict[str, torch.Tensor]) -> tuple[torch.Tensor, tuple[None, None]]:
        step = next(said)
        if step >= len(demonstration):
            raise KeyboardInterrupt
        chunk = convert.relative(chunk_at(actions, step)[:, :4].numpy(), batch["observation.state"].numpy())
        return torch.from_numpy(chunk).float(), (None, None)

    monkeypatch.setattr(ACT, "forward", predict)
    sent = sent_to_followers(monkeypatch)
    path, robot = relative / "checkpoints/last/pretrained_model", DECODING
    if decoder == "policy":
        path, robot = relative.with_name("attached"), ROBOT
        run(cli.main, "attach", str(relative), "--out", str(path), "--fps", "20")
    run(lerobot_rollout.main, f"--policy.path={path}", *robot, "--fps=100", "--task=Reach the cup.",
        "--return_to_initial_position=false")  # fmt: skip
    assert "Simulated episode 0: success" in capfd.readouterr().err
    np.testing.assert_allclose(sent[: len(demonstration) - 4], demonstration[:-4], atol=0.1)


@pytest.mark.slow
def test_stock_replay_of_an_encoded_dataset_drives_the_arm_as_recorded(
    policy: Path, recorded: Path, monkeypatch: pytest.MonkeyPatch
):
    encoded = policy.with_name("erj")
    replayed = ["--dataset.repo_id=me/reach_erj", f"--dataset.root={encoded}", "--dataset.episode=1"]
    sent = sent_to_followers(monkeypatch)
    run(lerobot_replay.main, *DECODING, f"--robot.inner.seed={SEED + 1}", f"--robot.spec={encoded}", *replayed,
        "--play_sounds=false")  # fmt: skip
    columns = LeRobotDataset("me/reach", root=recorded, video_backend="pyav").hf_dataset.with_format("numpy")[:]
    np.testing.assert_allclose(sent, columns[ACTION][columns["episode_index"] == 1], atol=0.1)  # [deg]


@pytest.mark.slow
@pytest.mark.parametrize("decoder", ["robot", "policy"])
def test_asynchronous_inference_drives_the_arm_as_demonstrated(
    decoder: str, policy: Path, attached: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """LeRobot's policy server and robot client: the robot decodes, or a server that has imported the plugin."""
    grpc = pytest.importorskip("grpc")
    monkeypatch.chdir(tmp_path)  # the modules write logs when they are imported
    from lerobot.async_inference import configs, policy_server, robot_client
    from lerobot.transport import services_pb2_grpc

    spec = json.loads((policy.with_name("erj") / "meta/info.json").read_text())["features"][ACTION]["info"]["er_il"]
    demonstration = in_degrees(script(SEED))
    actions = torch.from_numpy(Layout.from_spec(spec).encode(demonstration).astype(np.float32))
    _, _, *served = documented("docs/robots.md", "python -m lerobot.async_inference.policy_server")
    service = policy_server.PolicyServer(draccus.parse(configs.PolicyServerConfig, args=[*served, f"--fps={RATE}"]))

    def predict(policy: ACTPolicy, batch: object) -> torch.Tensor:
        assert service.last_processed_obs is not None
        return chunk_at(actions, service.last_processed_obs.get_timestep())

    monkeypatch.setattr(ACTPolicy, "predict_action_chunk", predict)
    sent = sent_to_followers(monkeypatch)
    send = interrupted_after(len(demonstration), robot_client.RobotClient.control_loop_action)
    monkeypatch.setattr(robot_client.RobotClient, "control_loop_action", send)
    server = grpc.server(ThreadPoolExecutor(4))
    services_pb2_grpc.add_AsyncInferenceServicer_to_server(service, server)
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    path = policy / "checkpoints/last/pretrained_model" if decoder == "robot" else attached
    _, _, *client = documented("docs/robots.md", "python -m lerobot.async_inference.robot_client")
    if decoder == "policy":
        client = [option for option in client if not option.startswith("--robot.")]
    with pytest.raises(KeyboardInterrupt):
        run(robot_client.async_client, *client, f"--server_address=127.0.0.1:{port}", f"--fps={RATE}",
            f"--pretrained_name_or_path={path}", *(DECODING if decoder == "robot" else ROBOT))  # fmt: skip
    server.stop(None)
    check_demonstrated(np.array(sent), demonstration)


@pytest.mark.slow
@pytest.mark.parametrize("decoder", ["robot", "policy"])
def test_real_time_chunking_drives_the_arm_as_demonstrated(
    decoder: str, policy: Path, attached: Path, monkeypatch: pytest.MonkeyPatch
):
    demonstration, actions = encoded_demonstration(policy)
    sent = sent_to_followers(monkeypatch)

    def predict(policy: ACTPolicy, batch: object, inference_delay: int, prev_chunk_left_over: object) -> torch.Tensor:
        return chunk_at(actions, len(sent))

    monkeypatch.setattr(ACTPolicy, "supports_rtc", lambda policy: True, raising=False)
    monkeypatch.setattr(ACTPolicy, "predict_action_chunk", predict)
    path = policy / "checkpoints/last/pretrained_model" if decoder == "robot" else attached
    run(lerobot_rollout.main, f"--policy.path={path}", *(DECODING if decoder == "robot" else ROBOT), f"--fps={RATE}",
        "--inference.type=rtc", "--inference.queue_threshold=10", "--duration=2", "--task=Reach the cup.",
        "--return_to_initial_position=false")  # fmt: skip
    check_demonstrated(np.array(sent), demonstration)


@pytest.mark.slow
def test_stock_rollout_refuses_the_policy_that_nothing_decodes(
    policy: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.delitem(sys.modules, "lerobot_env_er_il")  # imported anew, as in a process of its own
    sent = sent_to_followers(monkeypatch)
    with pytest.raises(SystemExit, match="2"):
        run(lerobot_rollout.main, f"--policy.path={policy / 'checkpoints/last/pretrained_model'}", *ROBOT,
            "--task=Reach the cup.")  # fmt: skip
    assert "--robot.type=er_il_arm --robot.inner.type=er_il_sim" in capsys.readouterr().err
    assert not sent


@pytest.mark.slow
def test_stock_rollout_records_episodes_of_the_trained_policy_in_joint_positions(attached: Path, tmp_path: Path):
    dataset = ["--dataset.repo_id=me/rollout_reach", f"--dataset.root={tmp_path / 'rollout'}", "--dataset.fps=60"]
    dataset += ["--dataset.num_episodes=2", f"--dataset.episode_time_s={EPISODE_TIME}", "--dataset.reset_time_s=0"]
    dataset += ["--dataset.single_task=Reach the cup.", "--dataset.push_to_hub=false", "--play_sounds=false"]
    with right_arrow_after(STEPS):
        run(lerobot_rollout.main, f"--policy.path={attached}", *ROBOT, "--strategy.type=episodic", f"--fps={RATE}",
            "--strategy.reset_to_initial_position=false", "--return_to_initial_position=false", *dataset)  # fmt: skip
    (root,) = tmp_path.iterdir()
    rollout = LeRobotDataset("me/rollout_reach", root=root, video_backend="pyav")
    assert rollout.num_episodes == 2
    assert rollout.features[ACTION]["names"] == NAMES
    columns = rollout.hf_dataset.with_format("numpy")[:]
    arm = SimFollower(SimFollowerConfig(camera_names=[]))._env.unwrapped.arm
    for episode in range(2):
        rows = columns["episode_index"] == episode
        q, measured = np.radians(columns[ACTION][rows][:, :7]), np.radians(columns["observation.state"][rows][:, :7])
        reach = arm.velocity / 20 + 1e-5
        # Untrained, it runs into things: an arm that was flung away goes on from where it is measured.
        follows = np.all(np.abs(np.diff(q, axis=0)) <= reach, axis=1)
        restarts = np.all(np.abs(q - measured) <= reach, axis=1)
        assert restarts[0]
        assert np.all(follows | restarts[1:])
        assert np.all(q >= arm.lower - 1e-6) and np.all(q <= arm.upper + 1e-6)


@pytest.mark.slow
def test_an_attached_policy_is_refused_where_the_environment_decodes(policy: Path, attached: Path):
    steps = json.loads((attached / "policy_preprocessor.json").read_text())["steps"]
    assert [step["registry_name"] for step in steps][:2] == [
        "rename_observations_processor",
        "relative_actions_processor",
    ]
    env = ErIlEnvConfig(action_space="erj").make()
    with pytest.raises(PolicyError, match="decodes its actions by itself"):
        check_policy(attached, env.space)
    with pytest.raises(SystemExit):
        run(cli.main, "attach", str(attached), "--out", str(attached) + "2")
    with pytest.raises(SystemExit):
        run(cli.main, "attach", str(policy), "--out", str(attached))


@pytest.mark.slow
def test_stock_replay_and_teleoperate(
    recorded: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    replayed = ["--dataset.repo_id=me/reach", f"--dataset.root={recorded}", "--dataset.episode=0"]
    run(lerobot_replay.main, *ROBOT, *replayed, "--play_sounds=false")
    lead = interrupted_after(len(script(SEED)), ScriptedLeader.get_action)
    monkeypatch.setattr(ScriptedLeader, "get_action", lead)
    run(lerobot_teleoperate.main, *ROBOT, *LEADER, "--fps=200")
    assert "Simulated episode 0: success" in capfd.readouterr().err


def test_one_plugin_registers_robot_and_teleoperator():
    register_third_party_plugins()
    assert RobotConfig.get_choice_class("er_il_sim") is SimFollowerConfig
    assert TeleoperatorConfig.get_choice_class("er_il_scripted_leader") is ScriptedLeaderConfig
    assert isinstance(make_robot_from_config(SimFollowerConfig(camera_names=[])), SimFollower)
    assert isinstance(make_teleoperator_from_config(ScriptedLeaderConfig()), ScriptedLeader)


def test_the_world_starts_over_when_lerobot_announces_an_episode():
    follower, leader = (
        SimFollower(SimFollowerConfig(seed=3, camera_names=[])),
        ScriptedLeader(ScriptedLeaderConfig(seed=3)),
    )
    logging.getLogger().setLevel(logging.INFO)
    follower.connect()
    leader.connect()
    first = follower.get_observation()
    logging.info("Recording episode 0")
    assert follower.get_observation() == first
    for _ in range(5):
        follower.send_action(leader.get_action())
    assert follower.get_observation() != first
    logging.info("Recording episode 1")
    second = follower.get_observation()
    other = SimFollower(SimFollowerConfig(seed=4, camera_names=[]))
    other.connect()
    assert second == other.get_observation()
    np.testing.assert_allclose(list(leader.get_action().values()), in_degrees(script(4))[0])
    for device in (follower, leader, other):
        device.disconnect()
        assert not device.is_connected


def test_the_robot_speaks_the_units_and_observes_the_pose_that_it_is_asked_for():
    robot = SimFollower(SimFollowerConfig(camera_names=[], units="rad", pose=True))
    robot.connect()
    seen = robot.get_observation()
    assert list(seen) == list(robot.observation_features)
    env = gymnasium.make(task_id("reach_cup"))
    np.testing.assert_allclose(list(seen.values()), env.reset(seed=0)[0]["agent_pos"])
    sent = robot.send_action(dict.fromkeys(robot.action_features, 99.0))
    assert sent["panda_joint1.pos"] == pytest.approx(2.8973)  # the URDF's limit
    robot.disconnect()


def test_mistakes():
    with pytest.raises(UnknownNameError, match=r"lift_cup.*reach_cup"):
        SimFollower(SimFollowerConfig(task="reach_cap"))
    with pytest.raises(UnknownNameError, match="rad, deg"):
        ScriptedLeader(ScriptedLeaderConfig(units="turns"))
    robot = SimFollower(SimFollowerConfig(camera_names=[]))
    robot.connect()
    with pytest.raises(ErIlError, match="er-il attach"):
        robot.send_action({"ee.x": 0.5, "gripper": 1.0})
