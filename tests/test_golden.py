"""Datasets, specifications, policies and traces that version 0.1.0 wrote (tests/golden) are read as they were then."""

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from lerobot.datasets import LeRobotDataset

from er_il import Arm
from er_il.cli import main
from er_il.datasets.dataset import Dataset
from er_il.datasets.record import DatasetRecord, read_episodes
from er_il.datasets.schema import LEADER_JOINTS
from er_il.envs.contract import policy_contract
from er_il.evaluation.trace import Trace
from er_il.kinematics.solver import Status
from er_il.policy.actor import Actor, environment_of
from er_il.spaces.layout import Layout
from er_il.spaces.spec import ACTION

GOLDEN = Path(__file__).parent / "golden"
TASK = GOLDEN / "push_button_elbow"
LENGTH = 68
KINDS = ("erj", "era", "delta_erj")

# What version 0.1.0 did with these files.
FIRST_ACTION = [0.45391542, 0.02230552, 0.6161285, 0.91330516, -0.0578732, 0.29358742, -0.00920121, 1.6354603, 0.0]
ENCODED = [
    *(2.21512690e-01, 6.30867295e-03, 4.60601985e-01, 9.14238572e-01, -2.42037922e-01, -3.24939191e-01),
    *(-2.87273020e-01, -9.52762783e-01, -9.85764265e-02, 1.58305392e-01, 4.37396616e-01, -9.37536210e-02),
    *(4.96705800e-01, 9.67014670e-01, -2.26583913e-01, 1.16371438e-01, -1.94764256e-01, -9.52161014e-01),
    *(-2.35491529e-01, 3.44061330e-02, 2.41379309e-02, 7.58620682e01, 2.41379318e01),
]
JOINTS = [
    *(-1.79570084e01, -3.94349432e00, -1.39164398e02, 2.41379309e-02, -1.27648449e01, 8.32993889e00, 1.64028442e02),
    *(7.58620682e01, -4.93936501e01, -5.90997171e00, 2.41379318e01, 1.93159521e00, -1.02970877e01, 5.98670673e00),
    *(-3.19351459e00, 6.04792442e01, 7.29608078e01),
]


def er_il(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> None:
    monkeypatch.setattr(sys, "argv", ["er-il", *map(str, arguments)])
    main()


@pytest.mark.parametrize("kind", KINDS)
def test_a_dataset_gives_its_leaders_joints_back(kind: str):
    dataset = Dataset(TASK / kind)
    layout, leader, actions = dataset.layout, dataset.vectors(LEADER_JOINTS), dataset.vectors(ACTION)
    assert (layout.kind, dataset.frames, list(dataset.episodes)) == (kind, LENGTH, [0])
    np.testing.assert_allclose(layout.encode(leader), actions, atol=1e-6)
    last = leader[0].astype(np.float64)
    for action, recorded in zip(actions, leader, strict=True):
        decoded = layout.decode(action, last)
        assert decoded.parts[0].status == Status.OK
        np.testing.assert_allclose(decoded.vector, recorded, atol=1e-3)
        last = decoded.vector


@pytest.mark.parametrize("kind", KINDS)
def test_a_specification_stays_what_it_is(kind: str):
    spec = Dataset(TASK / kind).spec
    assert json.loads(json.dumps(Layout.from_spec(spec).spec())) == spec


def test_the_record_and_lerobot_s_own_reader_agree():
    record, episode = DatasetRecord.read(TASK / "erj"), read_episodes(TASK / "erj")[0]
    assert (record.recipe.task, record.recipe.episodes, record.dropped) == ("push_button_elbow", 1, {})
    rows = LeRobotDataset("er_il/golden", root=TASK / "erj", video_backend="pyav").hf_dataset
    assert np.array_equal(np.stack(rows[ACTION]), episode.actions)
    assert {int(seed) for seed in rows["demo.seed"]} == {episode.seed}
    stored = json.loads((TASK / "erj/meta/recipe.json").read_text())
    assert {"recipe": record.recipe.to_dict(), "dropped": {}} == stored


@pytest.mark.parametrize("kind", KINDS)
def test_a_dataset_is_verified_and_viewed(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    er_il(monkeypatch, "verify", TASK / kind, "--out", tmp_path / "verify")
    report = json.loads((tmp_path / "verify/report.json").read_text())
    assert report["frames"] == LENGTH
    assert report["invalid_by_episode"] == {}
    assert report["arms"]["panda"]["joint_error"]["p100"] < 1e-3
    er_il(monkeypatch, "view", TASK / kind, "--save", tmp_path / "episode.rrd")
    assert (tmp_path / "episode.rrd").stat().st_size > 100_000


def test_a_specification_of_two_arms_encodes_and_decodes_as_it_did():
    layout = Dataset(GOLDEN / "bimanual").layout
    assert json.loads(json.dumps(layout.spec())) == Dataset(GOLDEN / "bimanual").spec
    np.testing.assert_allclose(layout.encode([JOINTS])[0], ENCODED, atol=1e-5)
    decoded = layout.decode(ENCODED, np.array(JOINTS) + 0.5)
    np.testing.assert_allclose(decoded.vector, JOINTS, atol=0.06)  # degrees


def test_a_policy_acts_as_it_did():
    config = environment_of(GOLDEN / "policy", "push_button_elbow", "erj")
    actor, env = Actor.load(GOLDEN / "policy", config), config.make()
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        observation, _ = env.reset(seed=1000)
        actor.reset(1000)
        seen = {key: np.asarray(value)[None] for key, value in observation.items()}
        action = actor.act(seen, getattr(env.unwrapped, "task_description"))[0]  # noqa: B009
        np.testing.assert_allclose(action, FIRST_ACTION, atol=1e-4)
        *_, info = env.step(action)
        assert info["command"].shape == (Arm.preset("panda").dof,)
    finally:
        env.close()
        torch.set_num_threads(threads)


def test_a_policy_is_known_by_its_dataset_or_else_by_its_tag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)  # the dataset is not at hand
    tagged = policy_contract(GOLDEN / "policy")
    assert (tagged.space, tagged.arm, tagged.redundant) == ("erj", "panda", "panda_joint1")
    shutil.copytree(
        TASK / "era", tmp_path / "push_button_elbow" / "erj"
    )  # another dataset where that of the policy was
    assert policy_contract(GOLDEN / "policy").space == "era"


def test_a_trace_is_loaded():
    trace, episode = Trace.load(GOLDEN / "trace.npz"), read_episodes(TASK / "erj")[0]
    assert (len(trace), trace.task, trace.label, trace.seed) == (
        LENGTH,
        "push_button_elbow",
        "erj episode 0",
        episode.seed,
    )
    np.testing.assert_array_equal(trace.action, episode.actions.astype(np.float64))
    np.testing.assert_allclose(trace.command, episode.leader[:, : Arm.preset("panda").dof], atol=1e-3)
