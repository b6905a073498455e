"""The page of public datasets: each row's command on a dataset with that schema, and all that the page says follows."""

import json
import re
import runpy
import shlex
import shutil
import sys
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torchvision
from documented import ROOT, blocks, documented, run
from lerobot.configs import PreTrainedConfig
from lerobot.datasets import LeRobotDataset
from lerobot.policies.act.modeling_act import ACTPolicy
from operating import interrupted_after
from public_schemas import (
    DROID,
    G1,
    G1_HANDS,
    G1_URDF,
    PANDA,
    SIDES,
    SIZE,
    agibot,
    droid,
    g1_arms,
    joint_paths,
    libero,
    older,
    openarm,
    openpi_droid,
    pictures,
    plain_libero,
    robomind,
    ucsd_kitchen,
    uma,
    unitree,
    write_agibot_arms,
    write_columns,
    xarm7,
)
from torch import nn

from er_il.datasets.dataset import Dataset
from er_il.datasets.schema import STATE
from er_il.experiments.studies import joints as joints_study
from er_il.robots.hardware import SimFollower
from er_il.spaces import joint_choice
from er_il.spaces.spec import ACTION

pytestmark = pytest.mark.usefixtures("quiet_logging", "one_worker")

PAGE = "docs/public_datasets.md"
EXACT = 1e-3  # [rad] as er-il verify has it
STEPS = 5  # of training, and of control
TINY = f"""--steps={STEPS} --batch_size=2 --num_workers=0 --policy.device=cpu --dataset.video_backend=pyav
    --policy.dim_model=32 --policy.dim_feedforward=32 --policy.n_heads=2 --policy.n_encoder_layers=1
    --policy.use_vae=false --policy.pretrained_backbone_weights=null --policy.chunk_size=4 --policy.n_action_steps=1"""
# What the page shows for DROID and means for every dataset.
VERIFY = documented("docs/public_datasets.md", "er-il verify droid_erj")
ADVISE = documented("docs/public_datasets.md", "er-il advise droid_erj")
VIEW = documented("docs/public_datasets.md", "er-il view droid_erj")
BACK = documented("docs/public_datasets.md", "er-il encode droid_erj --to joint")
TRAIN = documented("docs/public_datasets.md", "lerobot-train")
ATTACH = documented("docs/public_datasets.md", "er-il attach policies/droid_erj")
ROLL_OUT = documented("docs/public_datasets.md", "lerobot-rollout --policy.path=policies/droid_robot")
CONVERT = documented("docs/public_datasets.md", "python -m lerobot.scripts.convert_dataset_v21_to_v30")
POSES = documented("docs/public_datasets.md", "er-il verify libero_joints_erj --poses state")

Vector = tuple[str, slice, bool]  # column, perhaps of another dataset, dimensions, and whether they were measured


@dataclass(frozen=True)
class Row:
    """A schema: how to write it, the page's command, and the joint vector that must come back."""

    write: Callable[[Path], object]
    encode: list[str]
    names: list[str]
    vector: tuple[Vector, ...]
    camera: str = ""  # of a Panda: its policy is rolled out
    arms: int = 1
    poses: str = ""  # column of recorded poses that verify must find
    unit: float = 1.0  # of the joints [rad]

    @property
    def name(self) -> str:
        return self.encode[1]

    def of_this(self, command: list[str]) -> list[str]:
        """What the page shows for DROID, of this dataset."""
        words = [re.sub(r"(?<![a-z])droid(?=[_.])", self.name, word) for word in command]
        return [word.replace("observation.images.wrist_left", self.camera) for word in words]

    def commanded(self) -> np.ndarray:
        """The joint vectors (N, D), by what the columns hold; of what was measured, the next frame's."""
        found = []
        for text, dimensions, measured in self.vector:
            other, _, column = text.rpartition(":")
            source = Dataset(Path(other or self.name))
            values = source.vectors(column)[:, dimensions]
            if measured:
                episodes = [values[rows] for rows in source.episodes.values()]
                values = np.concatenate([np.concatenate([each[1:], each[-1:]]) for each in episodes])
            found.append(values)
        return np.hstack(found)


def write_g1(root: Path) -> None:
    shutil.copy(G1_URDF, "g1_29dof_rev_1_0.urdf")
    unitree(root, g1_arms())


def write_agibot(root: Path) -> None:
    agibot(root, write_agibot_arms(Path("G01_omnipicker.urdf")))


def write_xarm(root: Path) -> None:
    """Write version 2.1, and convert it as the page says."""
    older(xarm7(Path("new")), root)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", CONVERT[1:])
        runpy.run_module(CONVERT[1], run_name="__main__")


def write_libero_poses(root: Path) -> None:
    plain_libero(Path("libero_10hz"), fps=10)
    plain_libero(root, joints=False, fps=10)


ALL = slice(None)
KITCHEN = [f"motor_{i}" for i in range(7)]
OPENARM = [f"{side}_{motor}.pos" for side in SIDES for motor in (*(f"joint_{i}" for i in range(1, 8)), "gripper")]
AGIBOT = [f"{side}_arm_{i}" for side in SIDES for i in range(7)] + ["left_gripper", "right_gripper"]
ROWS = (
    Row(
        droid,
        documented("docs/public_datasets.md", "er-il encode droid --to"),
        DROID,
        ((ACTION, ALL, False),),
        camera="observation.images.wrist_left",
        poses="observation.state.cartesian_position",
    ),
    Row(
        openpi_droid,
        documented("docs/public_datasets.md", "er-il encode openpi_droid --to"),
        [*(f"joint_position.{i}" for i in range(7)), "actions.7"],
        (("joint_position", ALL, True), ("actions", slice(7, 8), False)),
        camera="observation.images.wrist_image_left",
    ),
    Row(
        robomind,
        documented("docs/public_datasets.md", "er-il encode robomind --to"),
        DROID,
        (("actions.joint_position", ALL, False),),
        camera="observation.images.camera_top",
        poses="observation.states.end_effector",
    ),
    Row(
        uma,
        documented("docs/public_datasets.md", "er-il encode uma --to"),
        [*(f"joint_{i}.pos" for i in range(1, 8)), "gripper.pos"],
        (("action.joint_position", ALL, False),),
        camera="observation.images.front",
        poses="source.observation.state",
    ),
    Row(
        libero,
        documented("docs/public_datasets.md", "er-il encode libero --to"),
        DROID,
        (("observation.states.joint_state", ALL, True), (ACTION, slice(6, 7), False)),
        camera="observation.images.wrist_image",
        poses="observation.states.ee_state",
    ),
    Row(
        plain_libero,
        documented("docs/public_datasets.md", "er-il encode libero_joints --to"),
        [*(f"joint_state.{i}" for i in range(7)), "actions.6"],
        (("joint_state", ALL, True), ("actions", slice(6, 7), False)),
        camera="observation.images.wrist_image",
        poses="state",
    ),
    Row(
        write_libero_poses,
        documented("docs/public_datasets.md", "er-il encode libero_poses --to"),
        [*(f"joint_state.{i}" for i in range(7)), "actions.6"],
        (("libero_10hz:joint_state", ALL, True), ("actions", slice(6, 7), False)),
        camera="observation.images.wrist_image",
    ),
    Row(
        write_xarm,
        documented("docs/public_datasets.md", "er-il encode xarm --to"),
        [*(f"j{i}" for i in range(1, 8)), "gripper"],
        ((ACTION, ALL, False),),
    ),
    Row(
        ucsd_kitchen,
        documented("docs/public_datasets.md", "er-il encode ucsd_kitchen --to"),
        [*KITCHEN, "gripper"],
        ((STATE, slice(7), True), (ACTION, slice(6, 7), False)),
    ),
    Row(
        openarm,
        documented("docs/public_datasets.md", "er-il encode openarm --to"),
        OPENARM,
        ((ACTION, ALL, False),),
        arms=2,
        unit=np.pi / 180,
    ),
    Row(
        write_g1,
        documented("docs/public_datasets.md", "er-il encode g1 --to"),
        [*G1, *G1_HANDS],
        ((ACTION, ALL, False),),
        arms=2,
    ),
    Row(
        write_agibot,
        documented("docs/public_datasets.md", "er-il encode agibot --to"),
        AGIBOT,
        (("actions.joint.position", ALL, False), ("actions.effector.position", ALL, False)),
        arms=2,
    ),
)


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the page's files of arms."""
    monkeypatch.chdir(tmp_path)
    for block in blocks(PAGE):
        if block.language == "yaml":  # its first line says which file it is
            Path(block.text.split("\n")[0].removeprefix("# ")).write_text(block.text)
    return tmp_path


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let ACT see with one layer in place of ResNet-18, whose 11 million weights take seconds, and advise try less."""

    def eye(**options: Any) -> nn.Module:
        return nn.Sequential(OrderedDict(layer4=nn.Conv2d(3, 8, SIZE // 2, stride=SIZE // 2), fc=nn.Linear(8, 1)))

    monkeypatch.setattr(torchvision.models, "resnet18", eye)
    monkeypatch.setattr(joints_study, "WORKSPACE", 30)
    monkeypatch.setattr(joint_choice, "ROUND_TRIPS", 10)


@pytest.mark.slow
@pytest.mark.parametrize("row", ROWS, ids=[row.name for row in ROWS])
def test_every_row_works_as_the_page_says(row: Row, workspace: Path, small: None, capsys) -> None:
    row.write(Path(row.name))
    run("er-il", *row.encode)
    said = capsys.readouterr().out
    assert ("in the next frame stands for the command" in said) == any(measured for *_, measured in row.vector)

    encoded = Dataset(Path(f"{row.name}_erj"))
    check_verified(row)
    run("er-il", *row.of_this(ADVISE))
    assert len(re.findall(r"^Command \S+:", capsys.readouterr().out, re.MULTILINE)) == row.arms
    run("er-il", *row.of_this(VIEW), *(("--arm", "left") if row.arms > 1 else ()))
    assert Path(f"{row.name}.rrd").stat().st_size > 1000
    check_back(row)

    run("lerobot-train", *row.of_this(TRAIN), *shlex.split(TINY))
    trained = PreTrainedConfig.from_pretrained(f"policies/{row.name}_erj/checkpoints/last/pretrained_model")
    outputs = {name: each.shape for name, each in (trained.output_features or {}).items()}
    assert outputs == {ACTION: (len(encoded.names(ACTION)),)}
    if row.camera:
        check_rolled_out(row)


def check_verified(row: Row) -> None:
    """Everything comes back, from frames that nothing flags, and the recorded poses are those of the arm."""
    run("er-il", *(POSES if row.name == POSES[1].removesuffix("_erj") else row.of_this(VERIFY)))
    report = json.loads(Path(f"outputs/{row.name}_erj/report.json").read_text())
    assert not report["broken_by_episode"] and len(report["arms"]) == row.arms
    for arm in report["arms"].values():
        assert not arm["finding"] and arm["joint_error_unflagged"]["p100"] < EXACT
    if row.poses:
        poses = report["arms"]["panda"]["poses"]
        assert poses["agrees"] and (poses["column"], poses["ee_frame"]) == (row.poses, PANDA.ee_frame)


def check_back(row: Row) -> None:
    """The joints as they were recorded: their names, order, units and values."""
    run("er-il", *row.of_this(BACK))
    back, source = Dataset(Path(f"{row.name}_again")), Dataset(Path(row.name))
    assert list(back.names(ACTION)) == row.names
    np.testing.assert_allclose(back.vectors(ACTION), row.commanded(), atol=EXACT / row.unit)
    if [column for column, *_ in row.vector] == [ACTION]:
        assert back.features == source.features


def check_rolled_out(row: Row) -> None:
    """The policy commands the simulated Panda, within its limits and from where it is."""
    run("er-il", *row.of_this(ATTACH))
    sent: list[np.ndarray] = []
    send = SimFollower.send_action

    def kept(robot: SimFollower, action: dict[str, float]) -> dict[str, float]:
        seen = robot.get_observation()
        names = [name for name in robot.action_features if name != "gripper.pos"]
        sent.append(np.array([[named[name] for name in names] for named in (action, seen)]))
        return send(robot, action)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SimFollower, "send_action", kept)
        patch.setattr(ACTPolicy, "select_action", interrupted_after(STEPS, ACTPolicy.select_action))
        run(*row.of_this(["lerobot-rollout", *ROLL_OUT]), "--return_to_initial_position=false")
    assert len(sent) == STEPS
    told, seen = np.array(sent).swapaxes(0, 1)
    assert np.all(told >= PANDA.lower - 1e-6) and np.all(told <= PANDA.upper + 1e-6)
    rate = Dataset(Path(f"{row.name}_erj")).fps
    assert np.all(np.abs(told[0] - seen[0]) <= PANDA.velocity / rate + 1e-4)  # it starts where the arm is measured


def test_cameras_that_no_policy_would_get_are_renamed_until_the_way_back(workspace: Path, capsys) -> None:
    episodes = [{ACTION: q, "wrist_image": pictures(len(q))} for q in joint_paths()]
    write_columns(Path("joints"), {ACTION: [f"{joint}.pos" for joint in PANDA.joints]}, episodes)
    run("er-il", "encode", "joints", "--to", "erj", "--arm", "panda", "--out", "erj")
    assert "Renamed to observation.images.*, since LeRobot's policies get no other cameras: wrist_image." in (
        capsys.readouterr().out
    )
    assert "wrist_image" not in Dataset(Path("erj")).features
    assert brightness("erj", "observation.images.wrist_image") == pytest.approx(3 / 255)
    assert "observation.images.wrist_image" in json.loads(Path("erj/meta/stats.json").read_text())
    run("er-il", "encode", "erj", "--to", "era", "--out", "era")
    run("er-il", "encode", "era", "--to", "joint", "--out", "again")
    assert Dataset(Path("again")).features == Dataset(Path("joints")).features
    assert brightness("again", "wrist_image") == pytest.approx(3 / 255)


def brightness(folder: str, camera: str) -> float:
    """The mean of the fourth picture, in [0, 1]."""
    frame: Any = LeRobotDataset(f"lab/{folder}", root=folder)[3]
    return frame[camera].mean().item()


@pytest.mark.slow
def test_datasets_without_joints_are_told_so(workspace: Path, capsys) -> None:
    plain_libero(Path("libero"), joints=False, fps=10)
    for more, complaint in (
        ((), "libero has no column action: name the columns of the joints"),
        (("--from", "actions:0,1,2,3,4,5,6"), r"look like changes \(deltas\), not like angles of panda"),
    ):
        with pytest.raises(AssertionError, match="exits with 2"):
            run("er-il", "encode", "libero", "--to", "erj", "--arm", "panda", "--out", "out", *more)
        error = capsys.readouterr().err.strip()
        assert re.search(complaint, error)
        assert "No column of libero seems to hold the joints of panda." in error
        assert "give --from DATASET:COLUMN" in error
    assert not Path("out").exists()


def test_every_row_of_the_table_has_its_command() -> None:
    page = (ROOT / PAGE).read_text()
    table = page[page.index("<!-- rows -->") : page.index("<!-- /rows -->")]
    linked = re.findall(r"^\| \[[^\]]+\]\(#([^)]+)\)", table, re.MULTILINE)
    assert len(linked) == len(ROWS) == len(table.strip().splitlines()) - 3  # the comment, head and rule
    sections = dict(zip(*[iter(re.split(r"^##+ (.*)$", page, flags=re.MULTILINE)[1:])] * 2, strict=True))
    commands = {heading_id(title): text for title, text in sections.items()}
    for anchor, row in zip(linked, ROWS, strict=True):
        assert f"er-il encode {row.name} --to erj" in commands[anchor]


def heading_id(title: str) -> str:
    """What a heading's anchor is on GitHub."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
