"""Numbers that cannot be are told where they enter: by episode, dimension and frame, in every command."""

import json
import shutil
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import save_file

from er_il import Arm
from er_il.cli import USER_MISTAKE, main
from er_il.datasets.dataset import EPISODE, Dataset
from er_il.datasets.integrity import STATS
from er_il.datasets.joint_paths import read_joint_paths
from er_il.datasets.number_checks import DEGREES, check_numbers, number_problems
from er_il.datasets.schema import ENVIRONMENT_STATE, LEADER_JOINTS, STATE
from er_il.datasets.wiring import Wiring, wire
from er_il.policy.training_data import check_training_data
from er_il.robots.attachment import attach
from er_il.spaces.layout import Layout
from er_il.spaces.spec import ACTION
from er_il.support.errors import DatasetError, ErIlError, PolicyError
from er_il.viewer.episode import trace_of_episode

PANDA = Arm.preset("panda")
NAMES = (*(f"{joint}.pos" for joint in PANDA.joints), "lift")
LENGTHS = (40, 30, 50)


@dataclass(frozen=True, eq=False)
class Held(Dataset):
    """A dataset of columns in memory."""

    columns: Mapping[str, np.ndarray] = field(default_factory=dict)

    def column(self, name: str) -> np.ndarray:
        return self.columns[name]


def held(lengths: tuple[int, ...] = LENGTHS) -> tuple[Held, Layout]:
    """Episodes of a Panda and a lift, commanded and measured."""
    t = np.arange(sum(lengths), dtype=np.float32)
    middle = np.append(PANDA.home, 0.5).astype(np.float32)
    commanded = middle + np.float32(0.3) * np.sin(t[:, None] / 20 + np.arange(8, dtype=np.float32))
    numbers = np.repeat(np.arange(len(lengths)), lengths)[:, None]
    dataset = Held(Path("held"), {ACTION: commanded, STATE: commanded - np.float32(0.01), EPISODE: numbers})
    feature = {"dtype": "float32", "shape": (8,), "names": list(NAMES)}
    dataset.__dict__["info"] = {"features": {ACTION: feature, STATE: dict(feature)}, "total_frames": len(t)}
    dataset.__dict__["info"]["total_episodes"] = len(lengths)
    return dataset, wire([Wiring(arm="panda")], dataset.features, "erj", "quat")


def test_sound_numbers_pass() -> None:
    assert number_problems(*held()) == {}


@settings(max_examples=60, deadline=None)
@given(
    column=st.sampled_from([ACTION, STATE]),
    places=st.sets(st.tuples(st.integers(0, sum(LENGTHS) - 1), st.integers(0, 7)), min_size=1, max_size=6),
    value=st.sampled_from([np.nan, np.inf, -np.inf, 1e30, -1e30, 3e38, 1e7]),
)
def test_every_bad_number_is_told_and_no_other(column: str, places: set[tuple[int, int]], value: float) -> None:
    dataset, layout = held()
    for row, dimension in places:
        dataset.columns[column][row, dimension] = value
    starts = np.cumsum((0, *LENGTHS))
    expected: dict[int, dict[str, list[int]]] = {}
    for row, dimension in sorted(places):
        episode = int(np.searchsorted(starts, row, side="right") - 1)
        expected.setdefault(episode, {}).setdefault(NAMES[dimension], []).append(row - int(starts[episode]))
    found = number_problems(dataset, layout)
    assert list(found) == sorted(expected)
    for episode, texts in found.items():
        assert len(texts) == len(expected[episode])
        for name, frames in expected[episode].items():
            more = f" and {len(frames) - 1} more" if len(frames) > 1 else ""
            assert f"{column} {name} is {value:.4g} in frame {frames[0]}{more}" in texts


@pytest.mark.parametrize("beyond", [0.2, 6.0, 6.4])
def test_a_joint_may_be_somewhat_beyond_its_limit_but_not_a_turn(beyond: float) -> None:
    dataset, layout = held()
    dataset.columns[ACTION][5, 1] = PANDA.upper[1] + beyond
    assert bool(number_problems(dataset, layout)) == (beyond > 2 * np.pi)


@pytest.mark.parametrize("dimensions", [[0, 3, 5], [7], list(range(8))])
@pytest.mark.parametrize(("column", "units"), [(ACTION, "degrees but measured in radians"), (STATE, "radians but")])
def test_degrees_beside_radians_are_told_by_episode(dimensions: list[int], column: str, units: str) -> None:
    dataset, layout = held()
    dataset.columns[column][40:70, dimensions] *= DEGREES  # the second episode
    (texts,) = (texts for number, texts in number_problems(dataset, layout).items() if number == 1)
    (text,) = [each for each in texts if "commanded in" in each]
    assert f"commanded in {units}" in text
    assert all((NAMES[i] in text) == (i in dimensions) for i in range(8))


def test_degrees_that_fit_the_limits_are_told_by_the_state_alone() -> None:
    dataset, _ = held()
    layout = wire([Wiring(arm="panda", units="deg")], dataset.features, "erj", "quat")
    dataset.columns[ACTION][:] *= DEGREES
    with pytest.raises(
        DatasetError, match=r"^held: .*3 of 3 episodes .*episode 2: lift, panda_joint1.* but measured in radians"
    ):
        check_numbers(dataset, layout)
    dataset.columns[STATE][:] *= DEGREES
    check_numbers(dataset, layout)


@settings(max_examples=40, deadline=None)
@given(
    lag=st.integers(0, 3),
    scale=st.sampled_from([1.0, 0.01, 0.04, 100.0, 1000.0]),
    centre=st.floats(-0.5, 0.5),
    seed=st.integers(0, 99),
)
def test_other_scales_of_a_gripper_and_lags_are_no_other_units(
    lag: int, scale: float, centre: float, seed: int
) -> None:
    dataset, layout = held()
    rng = np.random.default_rng(seed)
    action = dataset.columns[ACTION]
    action[:, 7] = rng.random(len(action)) > 0.5
    action[:, 0] = centre + rng.uniform(0.0, 0.3) * np.sin(np.arange(len(action)) / 10)
    dataset.columns[STATE][:] = np.roll(action, lag, axis=0) + rng.normal(0, 0.002, action.shape)
    dataset.columns[STATE][:, 7] = action[:, 7] * scale
    assert number_problems(dataset, layout) == {}


def test_a_message_lists_some_episodes_and_counts_the_rest() -> None:
    dataset, layout = held((5,) * 30)
    dataset.columns[ACTION][:] *= DEGREES
    dataset.columns[STATE][:] = dataset.columns[ACTION]
    with pytest.raises(DatasetError) as caught:
        check_numbers(dataset, layout)
    message = str(caught.value)
    assert "30 of 30 episodes are not sound: episode 0: action panda_joint" in message
    assert "; and 20 more episodes." in message and "--units deg" in message and "\n" not in message


def test_every_command_refuses_the_same(reach_cup: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    root = spoilt(reach_cup / "joint", tmp_path / "bad", {LEADER_JOINTS: (3, 0, 1e30), STATE: (0, 2, np.nan)})
    last = len(Dataset(root).episodes) - 1
    told = rf"2 of 3 episodes are not sound: .*episode 0: .*leader.joints.*episode {last}: observation.state"
    (tmp_path / "policy").mkdir()
    shape = {"output_features": {ACTION: {"shape": [8]}}}
    (tmp_path / "policy/config.json").write_text(json.dumps(shape))
    for act in (
        lambda: read_joint_paths(root),
        lambda: trace_of_episode(root, 0),
        lambda: check_training_data(Dataset(root), [STATE, ENVIRONMENT_STATE]),
        lambda: attach(tmp_path / "policy", tmp_path / "out", dataset=root),
    ):
        with pytest.raises(DatasetError, match=told if act.__code__.co_names[0] != "trace_of_episode" else "episode 0"):
            act()
    assert run(monkeypatch, "encode", root, "--to", "erj", "--out", tmp_path / "out") == USER_MISTAKE
    error = capsys.readouterr().err.strip()
    assert "2 of 3 episodes are not sound" in error and len(error.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def spoilt(source: Path, target: Path, spoil: Mapping[str, tuple[int, int, float]]) -> Path:
    """A copy of a dataset with a number in a row and dimension of some columns; in the last row if it is 0."""
    shutil.copytree(source, target)
    (path,) = target.glob("data/*/*.parquet")
    table = pq.read_table(path)
    for name, (row, dimension, value) in spoil.items():
        values = np.array(table.column(name).to_pylist(), dtype=np.float32)
        values[row or -1, dimension] = value
        index = table.schema.get_field_index(name)
        field = table.schema.field(name)
        table = table.set_column(index, field, pa.array(values.tolist(), field.type))
    pq.write_table(table, path)
    return target


def run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr(sys, "argv", ["er-il", *map(str, arguments)])
    try:
        main()
    except SystemExit as error:
        return int(error.code or 0)
    return 0


@pytest.mark.parametrize(
    ("space", "spoil", "told"),
    [
        ("erj", {}, ""),
        ("joint", {LEADER_JOINTS: (3, 0, 0.9)}, "panda does not come back in 1 frames"),
        ("erj", {LEADER_JOINTS: (3, 0, 200.0)}, "leader.joints panda_joint1.pos is 200 in frame 3"),
        ("erj", {ACTION: (3, 0, np.nan), STATE: (4, 1, np.inf)}, "action ee.x is nan in frame 3"),
    ],
)
def test_verify_fails_where_a_round_trip_is_not_what_is_promised(
    reach_cup: Path, tmp_path: Path, monkeypatch, capsys, space: str, spoil: dict, told: str
) -> None:
    root = spoilt(reach_cup / space, tmp_path / space, spoil)
    with monkeypatch.context() as patch:
        patch.setattr("er_il.support.workers.cpu_count", lambda: 1)
        assert run(patch, "verify", root, "--out", tmp_path / "report") == (1 if told else 0)
    error = capsys.readouterr().err.strip()
    assert told in error and len(error.splitlines()) == bool(told)
    report = json.loads((tmp_path / "report/report.json").read_text())
    assert list(report["broken_by_episode"]) == (["0"] if told else [])
    assert ("is inf in frame 4" in str(report["broken_by_episode"])) == (STATE in spoil)


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda stats: stats[ACTION]["mean"].__setitem__(2, float("nan")), "action mean is not finite for ee.z"),
        (
            lambda stats: stats[STATE]["std"].__setitem__(0, 0.0),
            "std is not positive for panda_joint1.pos, which varies",
        ),
        (lambda stats: stats[STATE].pop("std"), "observation.state has no std"),
        (lambda stats: stats.pop(ACTION), "action has none"),
        (lambda stats: stats[ENVIRONMENT_STATE].update(max=[1.0]), "max is no list of 7 numbers"),
        (lambda stats: stats[ENVIRONMENT_STATE].update(min=stats[ENVIRONMENT_STATE]["max"]), "min is not below max"),
    ],
)
def test_damaged_statistics_are_told_before_training(reach_cup: Path, tmp_path: Path, damage, told: str) -> None:
    inputs = [STATE, ENVIRONMENT_STATE]
    root = tmp_path / "erj"
    shutil.copytree(reach_cup / "erj", root)
    check_training_data(Dataset(root), inputs)
    stats = json.loads((root / STATS).read_text())
    damage(stats)
    (root / STATS).write_text(json.dumps(stats))
    with pytest.raises(DatasetError, match=told):
        check_training_data(Dataset(root), inputs)
    (root / STATS).unlink()
    with pytest.raises(DatasetError, match=r"has no meta/stats.json"):
        check_training_data(Dataset(root), inputs)


def test_a_policy_with_weights_that_are_not_finite_is_not_attached(reach_cup: Path, tmp_path: Path) -> None:
    policy = tmp_path / "policy"
    policy.mkdir()
    (policy / "config.json").write_text(json.dumps({"output_features": {ACTION: {"shape": [9]}}}))
    save_file({"head.bias": np.array([0.0, np.nan], dtype=np.float32)}, policy / "model.safetensors")
    with pytest.raises(PolicyError, match=r"head.bias in model.safetensors holds NaN or infinity"):
        attach(policy, tmp_path / "out", dataset=reach_cup / "erj")
    for rate in (np.nan, np.inf, 0.0, -20.0, 1e30):
        with pytest.raises(ErIlError, match="must be positive, and at most 1000 Hz"):
            attach(policy, tmp_path / "out", dataset=reach_cup / "erj", fps=rate)
