"""ERX from demonstrations to policies: weights that are fitted, written, encoded with, trained with and refused."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from documented import documented
from foreign import ARMS, write_bimanual, write_swing
from lerobot.datasets import LeRobotDatasetMetadata
from lerobot.datasets.aggregate import aggregate_datasets

from er_il import Arm
from er_il.cli import USER_MISTAKE, main
from er_il.datasets.dataset import Dataset
from er_il.datasets.record import read_episodes
from er_il.datasets.weights import ArmWeights, WeightsFile
from er_il.envs.contract import check_policy, decoder_for, policy_contract
from er_il.experiments.grid import Cell, Grid
from er_il.experiments.jobs import Demonstrate, FitWeights
from er_il.experiments.plan import Plan
from er_il.spaces.margin import demonstrated_weights
from er_il.spaces.registry import erx_name, make_arm_space
from er_il.support.errors import PolicyError

PANDA = Arm.preset("panda")
FIRST = (tuple(np.eye(7)[0].tolist()),)
GRID = {
    "title": "Tiny",
    "tasks": ["reach_cup"],
    "decoders": ["joint", "erj"],
    "demonstrations": [1, 2],
    "training_seeds": [0],
    "rollouts": 2,
    "episodes": 3,
}


def er_il(patch: pytest.MonkeyPatch, *arguments: object) -> None:
    patch.setattr(sys, "argv", ["er-il", *map(str, arguments)])
    main()


def mistake(patch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    capsys.readouterr()
    with pytest.raises(SystemExit) as left:
        er_il(patch, *arguments)
    assert left.value.code == USER_MISTAKE
    said = capsys.readouterr().err.strip()
    assert "\n" not in said and "Traceback" not in said
    return said


def weights_of(dataset: Path) -> tuple[tuple[float, ...], ...]:
    (arm,) = Dataset(dataset).layout.arms.values()
    return arm.weights


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The first joint's row as a file of weights."""
    WeightsFile(arms={"": ArmWeights.of(PANDA, FIRST)}).write(tmp_path / "first.json")
    return tmp_path / "first.json"


@pytest.mark.slow
def test_weights_are_fitted_to_a_dataset_which_is_encoded_with_them(
    reach_cup: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    one_worker: None,
) -> None:
    monkeypatch.chdir(tmp_path)
    write_swing(tmp_path / "my_robot", [f"{joint}.pos" for joint in PANDA.joints])
    out, told = tmp_path / "my_robot_erx", tmp_path / "advice.json"
    er_il(
        monkeypatch,
        *documented("docs/choosing.md", "er-il advise my_robot --arm panda --units deg --fit"),
        "--json",
        told,
    )
    said = " ".join(capsys.readouterr().out.split())
    rows = {row["space"]: row for row in json.loads(told.read_text())["margins"]}
    fitted = rows["erx (fitted)"]
    assert fitted["smallest"] > max(row["smallest"] for name, row in rows.items() if name != "erx (fitted)")
    assert f"at least {fitted['smallest']:.2f} (episode {fitted['episode']}, step {fitted['step']})" in said
    assert fitted["risk"] <= min(row["risk"] for row in rows.values())
    assert (tmp_path / "outputs/weights.png").read_bytes().startswith(b"\x89PNG")
    er_il(monkeypatch, *documented("docs/choosing.md", "er-il encode my_robot --arm panda --units deg --to erx"))
    assert erx_name(weights_of(out)) == fitted["name"]
    assert Dataset(out).names("action")[-2:] == ("self_motion", "gripper")
    first, *_ = weights_of(out)[0]
    assert f"| self-motion {first:.2f} panda_joint1 - " in (out / "README.md").read_text()
    er_il(monkeypatch, "verify", out, "--out", tmp_path / "report")
    report = json.loads((tmp_path / "report/report.json").read_text())
    assert report["arms"]["panda"]["joint_error"]["p100"] < 1e-3
    er_il(monkeypatch, "encode", out, "--to", "delta_erx", "--out", tmp_path / "delta")  # it keeps its weights
    assert weights_of(tmp_path / "delta") == weights_of(out)
    fitted_here = tmp_path / "datasets/reach_cup_fitted"
    fitted_here.mkdir(parents=True)
    (fitted_here / "joint").symlink_to(reach_cup / "joint")
    er_il(monkeypatch, *documented("docs/choosing.md", "er-il generate reach_cup --spaces erx"), "--episodes", 3)
    assert weights_of(fitted_here / "erx") == weights_of(out)


def test_two_arms_have_weights_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_bimanual(tmp_path / "source")
    (tmp_path / "arms.yaml").write_text(ARMS)
    xarm = Arm.preset("xarm7")
    entries = {"left": ArmWeights.of(PANDA, FIRST), "right": ArmWeights.of(xarm, xarm.weights)}
    WeightsFile(arms=entries).write(tmp_path / "weights.json")
    options = ("--to", "erx", "--arms", tmp_path / "arms.yaml", "--weights", tmp_path / "weights.json")
    er_il(monkeypatch, "encode", tmp_path / "source", *options, "--out", tmp_path / "erx")
    layout = Dataset(tmp_path / "erx").layout
    assert {label: arm.weights for label, arm in layout.arms.items()} == {"left": FIRST, "right": xarm.weights}
    assert {"left_self_motion", "right_self_motion"} < set(layout.encoded_names)


def test_mistakes_with_weights_are_one_line(
    reach_cup: Path, tmp_path: Path, file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = reach_cup / "joint", tmp_path / "out"

    def refused(values: object) -> str:
        bad = tmp_path / "bad.json"
        bad.write_text(values if isinstance(values, str) else json.dumps(values))
        return mistake(monkeypatch, capsys, "encode", source, "--to", "erx", "--weights", bad, "--out", out)

    good = json.loads(file.read_text())
    own = good["arms"][""]
    assert "not valid YAML" in refused("{")
    assert "The file of weights lacks arms" in refused({})
    assert "lacks" in refused({"arms": {"": {"arm": "panda"}}})
    assert "are no orthonormal rows" in refused({"arms": {"": own | {"weights": [[1.0, 1.0, 0, 0, 0, 0, 0]]}}})
    assert "are not 1 rows of 7 numbers" in refused({"arms": {"": own | {"weights": [[1.0]]}}})
    assert "The weights are of panda" in refused({"arms": {"": own | {"joints": own["joints"][::-1]}}})
    assert "The weights are of xarm7" in refused({"arms": {"": own | {"arm": "xarm7", "fingerprint": "0"}}})
    assert "of the arms 'left', the actions of ''" in refused({"arms": {"left": own}})
    encode = ("encode", source, "--out", out, "--weights")
    assert "There is no file of weights" in mistake(monkeypatch, capsys, *encode, tmp_path / "no", "--to", "erx")
    assert "Weights are for erx, not for erj" in mistake(monkeypatch, capsys, *encode, file, "--to", "erj")
    assert "panda has no demonstrations" in mistake(monkeypatch, capsys, "advise", "panda", "--fit", "erx")
    assert "--weights is for --fit erx" in mistake(monkeypatch, capsys, "advise", "panda", "--weights", out)
    assert not out.exists()


def test_demonstrations_are_generated_with_weights_and_other_ones_refused(
    reach_cup: Path, tmp_path: Path, file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "reach_cup"
    out.mkdir()
    (out / "joint").symlink_to(reach_cup / "joint")
    generate = ("generate", "reach_cup", "--episodes", 3, "--spaces", "erx", "--out", out)
    er_il(monkeypatch, *generate, "--weights", file)
    assert weights_of(out / "erx") == FIRST
    said = mistake(monkeypatch, capsys, *generate)
    assert "has other weights of its linear coordinates; choose another --out" in said


def test_lerobot_does_not_merge_datasets_of_different_weights(
    reach_cup: Path, tmp_path: Path, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = reach_cup / "joint"
    er_il(monkeypatch, "encode", source, "--to", "erx", "--out", tmp_path / "own")
    er_il(monkeypatch, "encode", source, "--to", "erx", "--weights", file, "--out", tmp_path / "first")
    roots = [tmp_path / "own", tmp_path / "first"]
    with pytest.raises(ValueError, match="linear_coordinates"):
        aggregate_datasets(["lab/own", "lab/first"], "lab/both", roots=roots, aggr_root=tmp_path / "both")
    assert LeRobotDatasetMetadata("lab/own", root=roots[0]).features["action"]["names"][-2] == "self_motion"


def test_a_policy_is_decoded_with_the_weights_that_it_was_trained_with(tmp_path: Path) -> None:
    tag = f"er_il:erx/panda/panda_hand_tcp/quat/{erx_name(FIRST).partition('@')[2]}"
    (tmp_path / "config.json").write_text(json.dumps({"type": "act", "tags": [tag]}))
    chosen = decoder_for("erx", policy_contract(tmp_path))
    assert chosen.space_of(PANDA).arm.weights == FIRST
    check_policy(tmp_path, chosen.space_of(PANDA))
    with pytest.raises(PolicyError, match=r"another action space: redundant '1\.0:0\.0:.* not '0\.7359"):
        check_policy(tmp_path, make_arm_space("erx", PANDA))
    with pytest.raises(PolicyError, match="another action space: space 'erx' not 'erj'"):
        check_policy(tmp_path, decoder_for("erj", policy_contract(tmp_path)).space_of(PANDA))


def test_a_grid_fits_weights_to_the_demonstrations_that_a_policy_sees(reach_cup: Path, tmp_path: Path) -> None:
    before, after = (Plan(Grid.from_dict(GRID | {"decoders": names}), tmp_path) for names in _DECODERS)
    others = {job for job in after.jobs if job.decoder != "erx"}
    assert others == set(before.jobs)  # nothing is done again
    trainings = [after.training(Cell("reach_cup", "erx", count), 0) for count in (1, 2)]
    assert len({training.needs for training in trainings}) == 2
    recipe = after.grid.recipe("reach_cup")
    demonstrated = Demonstrate(reach_cup, "demonstrate", (), 3, recipe, ("joint",), 1)
    leader = [episode.leader[:, :7].astype(np.float64) for episode in read_episodes(reach_cup / "joint")]
    for count in (1, 2):
        job = FitWeights(tmp_path / f"erx-{count}", f"fit {count}", (demonstrated,), 1, "erx", count)
        job.run()
        assert job.done and weights_of(job.dataset("erx")) == demonstrated_weights(PANDA, leader[:count])
        assert Dataset(job.path).count == 3 and job.recipe == recipe


_DECODERS = (["joint", "erj"], ["joint", "erj", "erx"])


def test_a_grid_of_erx_alone_records_joints(tmp_path: Path) -> None:
    (job,) = Plan(Grid.from_dict(GRID | {"decoders": ["erx"], "demonstrations": [1]}), tmp_path).jobs
    (training,) = job.needs
    (fit,) = training.needs
    assert isinstance(fit, FitWeights) and fit.needs[0].spaces == ("joint",)
