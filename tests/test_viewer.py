"""Recordings of episodes, written as files and read back: what they show is what the data say."""

import io
import re
import resource
import signal
import socket
import subprocess
import sys
import urllib.request
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from lerobot.datasets import LeRobotDataset
from PIL import Image
from rerun.experimental import RrdReader
from rich.progress import Progress
from scipy.spatial.transform import Rotation

from er_il import Arm, make_action_space
from er_il.arms.portable import arm_spec
from er_il.cli import USER_MISTAKE, main
from er_il.datasets.recipe import Recipe
from er_il.datasets.recording import generate
from er_il.datasets.schema import DEMO_SEED, ENVIRONMENT_STATE, STATE
from er_il.evaluation.trace import Trace
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.spec import ACTION
from er_il.support.errors import ArmError, ErIlError
from er_il.support.shapes import POSE_NAMES
from er_il.viewer.arm import drawable_urdf
from er_il.viewer.show import save_recording
from er_il.viewer.source import read_source

TASK, EPISODE, CAMERA = "lift_cup", 1, "wrist"
ARM = Arm.preset("panda")


def er_il(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> None:
    monkeypatch.setattr(sys, "argv", ["er-il", *map(str, arguments)])
    main()


class Recorded:
    """The columns of a recording, by entity: temporal ones (T, ...), static ones once."""

    def __init__(self, path: Path) -> None:
        self.reader = RrdReader(path)
        self.columns: dict[tuple[str, str], list] = {}
        self.times: dict[str, dict[str, list]] = {}
        for chunk in self.reader.store().stream():
            batch, entity = chunk.to_record_batch(), str(chunk.entity_path)
            for name in batch.schema.names:
                values = batch.column(name).to_pylist()
                if name in ("frame", "time"):
                    self.times.setdefault(entity, {})[name] = values
                elif ":" in name:
                    self.columns[entity, name] = values

    def __getitem__(self, key: tuple[str, str]) -> np.ndarray:
        """Values of a component, one instance a row."""
        return np.array([row[0] for row in self.columns[key]])

    @property
    def entities(self) -> set[str]:
        return {entity for entity, _ in self.columns}

    def transforms(self, entity: str) -> np.ndarray:
        """Poses (T, 4, 4) of an entity."""
        T = np.tile(np.eye(4), (len(self[entity, "Transform3D:translation"]), 1, 1))
        T[:, :3, 3] = self[entity, "Transform3D:translation"]
        if (entity, "Transform3D:quaternion") in self.columns:
            T[:, :3, :3] = Rotation.from_quat(self[entity, "Transform3D:quaternion"]).as_matrix()
        return T

    def frames(self) -> dict[str, tuple[str, np.ndarray]]:
        """Child frame -> its parent frame and pose in it; moving joints replace the URDF's rest."""
        found: dict[str, tuple[str, np.ndarray]] = {}
        entities = sorted(entity for entity in self.entities if entity.startswith("/arm/"))
        fixed, joints = "/arm/fixed", [entity for entity in entities if entity.startswith("/arm/joints/")]
        for i, T in enumerate(self.transforms(fixed)):
            child, parent = (self[fixed, f"Transform3D:{side}_frame"][i] for side in ("child", "parent"))
            found[child] = parent, T[None]
        for entity in ["/arm/base", *joints]:
            child, parent = (self[entity, f"Transform3D:{side}_frame"][0] for side in ("child", "parent"))
            found[child] = parent, self.transforms(entity)
        return found

    def pose_of(self, frame: str) -> np.ndarray:
        """Poses (T, 4, 4) of a link in the recording's root frame."""
        frames, T = self.frames(), np.eye(4)[None]
        while frame != "tf#/":
            frame, T_parent_child = frames[frame]
            T = T_parent_child @ T
        return T


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> SimpleNamespace:
    """An episode of a dataset, and its recording by ``er-il view``."""
    folder = tmp_path_factory.mktemp("viewer")
    recipe = Recipe.load(TASK).resized(2).replaced(cameras=(CAMERA,), image_size=48)
    root = generate(recipe, ["erj"], folder / TASK, Progress(disable=True), workers=1).paths["erj"]
    dataset = LeRobotDataset("er_il/test", root=root, episodes=[EPISODE], video_backend="pyav")
    with pytest.MonkeyPatch.context() as patch:
        er_il(patch, "view", root, "--episode", EPISODE, "--save", folder / "new" / "episode.rrd")
    assert [path.name for path in (folder / "new").iterdir()] == ["episode.rrd"]
    columns = {name: np.stack(dataset.hf_dataset[name]) for name in (STATE, ACTION, ENVIRONMENT_STATE, DEMO_SEED)}
    return SimpleNamespace(
        root=root,
        dataset=dataset,
        columns=columns,
        path=folder / "new" / "episode.rrd",
        recorded=Recorded(folder / "new" / "episode.rrd"),
    )


def test_every_joint_and_link_is_there(shown: SimpleNamespace) -> None:
    entities = shown.recorded.entities
    fingers = ("panda_finger_joint1", "panda_finger_joint2")
    assert {f"/arm/joints/{joint}" for joint in (*ARM.joints, *fingers)} <= entities
    for link in [*(f"panda_link{i}" for i in range(8)), "panda_hand", "panda_leftfinger", "panda_rightfinger"]:
        assert f"/arm/panda/visual_geometries/{link}/visual_0" in entities


def test_the_arm_stands_where_forward_kinematics_puts_it(shown: SimpleNamespace) -> None:
    q = shown.columns[STATE][:, : ARM.dof].astype(np.float64)
    for frame in ("panda_link4", "panda_hand_tcp"):
        expected = kinematics_of(ARM).fk_batch(q, frame)
        np.testing.assert_allclose(shown.recorded.pose_of(frame), expected, atol=1e-5)
    left = shown.recorded.pose_of("panda_leftfinger")[:, :3, 3] - shown.recorded.pose_of("panda_rightfinger")[:, :3, 3]
    np.testing.assert_allclose(np.linalg.norm(left, axis=1), 0.08 * shown.columns[STATE][:, ARM.dof], atol=1e-5)


def test_the_curves_are_the_data(shown: SimpleNamespace) -> None:
    recorded, scalars = shown.recorded, "Scalars:scalars"
    state, action = shown.columns[STATE], shown.columns[ACTION]
    names = shown.dataset.features[ACTION]["names"]
    for i, joint in enumerate(ARM.joints):
        np.testing.assert_allclose(recorded[f"/joints/{joint}/measured", scalars], state[:, i], atol=1e-6)
    for i, name in enumerate(names):
        np.testing.assert_allclose(recorded[f"/action/{name}/action", scalars], action[:, i], atol=1e-6)
    for i, axis in enumerate("xyz"):
        position = recorded[f"/end_effector/{axis}/measured", scalars]
        np.testing.assert_allclose(position, state[:, ARM.dof + 1 + i], atol=1e-5)
    # An ERJ action says the pose and the first joint that the decoded command then has.
    np.testing.assert_allclose(
        recorded["/redundancy/panda_joint1/command", scalars],
        action[:, names.index("panda_joint1.pos")],
        atol=1e-3,
    )
    np.testing.assert_allclose(recorded["/end_effector/x/command", scalars], action[:, names.index("ee.x")], atol=2e-4)
    assert recorded["/status", "StateChange:state"].tolist() == ["ok"] * len(action)


def test_time_runs_in_frames_and_seconds(shown: SimpleNamespace) -> None:
    steps = len(shown.columns[ACTION])
    for entity in ("/joints/panda_joint1/measured", "/arm/joints/panda_joint1", "/scene/cup", f"/cameras/{CAMERA}"):
        times = shown.recorded.times[entity]
        assert times["frame"] == list(range(steps))
        seconds = [time.total_seconds() for time in times["time"]]
        np.testing.assert_allclose(seconds, np.arange(steps) / 20, atol=1e-6)


def test_the_cup_moves_as_the_environment_state_says(shown: SimpleNamespace) -> None:
    names = shown.dataset.features[ENVIRONMENT_STATE]["names"]
    poses = shown.columns[ENVIRONMENT_STATE][:, [names.index(f"cup.{part}") for part in POSE_NAMES]]
    recorded = shown.recorded
    np.testing.assert_allclose(recorded["/scene/cup", "Transform3D:translation"], poses[:, :3], atol=1e-6)
    np.testing.assert_allclose(recorded["/scene/cup", "Transform3D:quaternion"], poses[:, 3:], atol=1e-6)
    assert any(entity.startswith("/scene/cup/") for entity in recorded.entities)
    assert any(entity.startswith("/scene/fixtures/") for entity in recorded.entities)


def test_cameras_show_the_dataset_s_images(shown: SimpleNamespace) -> None:
    blobs = shown.recorded.columns[f"/cameras/{CAMERA}", "EncodedImage:blob"]
    assert len(blobs) == len(shown.dataset)
    for i in (0, len(blobs) - 1):
        seen = np.asarray(Image.open(io.BytesIO(bytes(blobs[i][0]))), dtype=float)
        expected = 255 * shown.dataset[i][f"observation.images.{CAMERA}"].numpy().transpose(1, 2, 0)
        assert seen.shape == expected.shape
        assert np.abs(seen - expected).mean() < 5


def test_a_layout_travels_with_the_recording(shown: SimpleNamespace) -> None:
    assert [entry.application_id for entry in shown.recorded.reader.blueprints()] == ["er_il"]
    assert shown.path.stat().st_size < 2e6


def compare(one: Path, other: Path) -> bool:
    """Whether Rerun finds two recordings equal."""
    command = [sys.executable, "-m", "rerun", "rrd", "compare", "--unordered", str(one), str(other)]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def test_equal_episodes_give_equal_recordings(shown: SimpleNamespace, tmp_path: Path) -> None:
    trace, shapes = read_source(shown.root, EPISODE)
    save_recording(trace, shapes, tmp_path / "again.rrd")
    save_recording(replace(trace, q=trace.q + 1e-3), shapes, tmp_path / "other.rrd")
    assert compare(shown.path, tmp_path / "again.rrd")
    assert not compare(shown.path, tmp_path / "other.rrd")


def test_a_rollout_is_shown_with_its_statuses(
    shown: SimpleNamespace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trace: Trace = read_source(shown.root, EPISODE)[0]
    status = ("ok", "limit", "unreachable", *trace.status[3:])
    replace(trace, status=status, label="erj", outcome="collision", images={}).save(tmp_path / "rollout.npz")
    er_il(monkeypatch, "view", tmp_path / "rollout.npz", "--save", tmp_path / "rollout.rrd")
    recorded = Recorded(tmp_path / "rollout.rrd")
    assert tuple(recorded["/status", "StateChange:state"]) == status
    assert "/scene/cup" in recorded.entities
    about = recorded["/about", "TextDocument:text"][0]
    for text in (TASK, "erj", "collision", str(shown.columns[DEMO_SEED][0].item()), f"2 of {len(status)}"):
        assert text in about


def test_a_full_disk_is_an_error_that_leaves_nothing(shown: SimpleNamespace, tmp_path: Path) -> None:
    path, limits = tmp_path / "episode.rrd", resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        with pytest.raises(ErIlError, match=r"Cannot write .*episode\.rrd: File too large"):
            save_recording(*read_source(shown.root, EPISODE), path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert list(tmp_path.iterdir()) == []


def test_a_served_episode_reaches_the_browser(shown: SimpleNamespace, tmp_path: Path) -> None:
    read_source(shown.root, EPISODE)[0].save(tmp_path / "trace.npz")
    # Its own process: on Ctrl-C it must end, and by itself it must not.
    command = [sys.executable, "-c", "from er_il.cli import main; main()", "view", str(tmp_path / "trace.npz")]
    # Where the tests run in the background, Ctrl-C is ignored, and children inherit that.
    heeds = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    with subprocess.Popen([*command, "--serve"], stdout=subprocess.PIPE, text=True, preexec_fn=heeds) as server:
        try:
            assert server.stdout is not None
            address = urlsplit(server.stdout.readline().strip())
            with urllib.request.urlopen(f"http://{address.netloc}/") as page:
                assert b"rerun" in page.read().lower()
            with pytest.raises(ConnectionRefusedError):  # another address of this machine
                socket.create_connection(("127.0.0.2", address.port), timeout=5).close()
            assert re.fullmatch(r"rerun\+http://127\.0\.0\.1:\d+/proxy", parse_qs(address.query)["url"][0])
        finally:
            server.send_signal(signal.SIGINT)
        try:
            assert server.wait(timeout=60) == 0
            with pytest.raises(ConnectionRefusedError):  # nothing is left behind
                socket.create_connection(("127.0.0.1", address.port or 0), timeout=5).close()
        finally:
            server.kill()  # else the block would wait for it


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{root}", "--episode", "2", "--save", "{out}/a.rrd"], "has no episode 2. Valid: 0 to 1"),
        (["{root}", "--serve", "--address", "here"], "'here' is no IP address to listen on. Valid: 127.0.0.1"),
        (["{root}", "--serve", "--address", "192.0.2.1"], "Cannot listen on 192.0.2.1"),
        (["{root}", "--save", "{out}/a.txt"], "Rerun knows its files by .rrd"),
        (["{root}", "--save", "/dev/null/a.rrd"], "/dev/null"),
        (["{out}", "--save", "{out}/a.rrd"], "{out}"),
        (["{out}/absent.npz", "--save", "{out}/a.rrd"], "There is no dataset or trace"),
        (["{root}"], "no display"),
    ],
)
def test_mistakes_are_one_line(
    shown: SimpleNamespace,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    places = {"root": shown.root, "out": tmp_path}
    with pytest.raises(SystemExit) as exit_info:
        er_il(monkeypatch, "view", *(argument.format(**places) for argument in arguments))
    assert exit_info.value.code == USER_MISTAKE
    error = capsys.readouterr().err
    assert message.format(**places) in error
    assert len(error.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_an_arm_without_shapes_is_drawn_as_lines(shown: SimpleNamespace, tmp_path: Path) -> None:
    urdf = tmp_path / "mine.urdf"
    urdf.write_text(ARM.model_xml)
    mine = Arm.from_urdf(urdf, name="mine", ee_frame=ARM.ee_frame, joints=ARM.joints, home=ARM.home)
    trace = read_source(shown.root, EPISODE)[0]
    spec = make_action_space("erj", mine).spec()
    spec = spec | {"arm": spec["arm"] | arm_spec(mine)}
    save_recording(replace(trace, task="", spec=spec), [], tmp_path / "mine.rrd")
    recorded = Recorded(tmp_path / "mine.rrd")
    assert {f"/arm/bones/{joint}" for joint in ARM.joints} <= recorded.entities
    q = shown.columns[STATE][:, : ARM.dof].astype(np.float64)
    np.testing.assert_allclose(recorded.pose_of(ARM.ee_frame), kinematics_of(ARM).fk_batch(q), atol=1e-5)
    assert not any(entity.startswith("/arm/bones") for entity in shown.recorded.entities)


URDF = """<robot name="two"><link name="base"><visual><geometry><mesh filename="package://two_arm/meshes/{mesh}"/>
</geometry></visual></link></robot>"""


def test_meshes_are_found_in_their_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    urdf = tmp_path / "two_arm" / "urdf" / "two.urdf"
    mesh = tmp_path / "two_arm" / "meshes" / "base.stl"
    for path in (urdf, mesh):
        path.parent.mkdir(parents=True)
        path.write_text(URDF.format(mesh="base.stl"))
    assert f'filename="{mesh}"' in drawable_urdf(urdf)
    elsewhere = tmp_path / "elsewhere" / "two.urdf"
    elsewhere.parent.mkdir()
    elsewhere.write_text(urdf.read_text())
    (tmp_path / "two_arm").rename(tmp_path / "elsewhere" / "two_arm")  # beside the URDF
    assert str(tmp_path / "elsewhere" / "two_arm" / "meshes" / "base.stl") in drawable_urdf(elsewhere)
    elsewhere.write_text(URDF.format(mesh="absent.stl"))
    with pytest.raises(ArmError, match=r"absent\.stl"):
        drawable_urdf(elsewhere)
