"""Folders from others: nothing in them is executed, and no link in them is followed out."""

import json
import shutil
from pathlib import Path

import pytest
from documented import run

from er_il.datasets.reencoding import reencode
from er_il.envs.contract import check_policy
from er_il.envs.lerobot_plugin import ErIlEnvConfig
from er_il.envs.trust import PROCESSORS, check_steps
from er_il.support.errors import ErIlError, PolicyError
from er_il.support.links import check_links

GOLDEN = Path(__file__).parent / "golden"


@pytest.fixture
def policy(tmp_path: Path) -> Path:
    """A policy with a post-processor that starts a program when LeRobot loads it."""
    copy = tmp_path / "policy"
    shutil.copytree(GOLDEN / "policy", copy)
    file = copy / PROCESSORS[1]
    processor = json.loads(file.read_text())
    touch = ["touch", str(tmp_path / "executed")]
    processor["steps"].append({"class": "subprocess.Popen", "config": {"args": touch}})
    file.write_text(json.dumps(processor))
    return copy


def test_a_policy_that_names_a_class_to_import_is_not_loaded(
    policy: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    check_steps(GOLDEN / "policy")
    for command in (
        ["eval", str(policy), "--task", "push_button_elbow", "--decoder", "erj"],
        ["attach", str(policy), "--out", str(tmp_path / "out"), "--dataset", str(GOLDEN / "push_button_elbow" / "erj")],
    ):
        with pytest.raises(AssertionError, match="exits with 2"):
            run("er-il", *command)
        error = " ".join(capsys.readouterr().err.split())
        assert "asks LeRobot to import and call 'subprocess.Popen'" in error and "--trust" in error
    # lerobot-eval makes the environments before it loads the policy.
    evaluating = ErIlEnvConfig(task="push_button_elbow", action_space="erj")
    with pytest.raises(PolicyError, match=r"--env.trust=true"):
        check_policy(policy, evaluating.layout, evaluating.trust)
    check_policy(policy, evaluating.layout, trust=True)
    assert not (tmp_path / "executed").exists() and not (tmp_path / "out").exists()


@pytest.mark.parametrize("steps", [None, {}, [None], [{"registry_name": None}], [{"registry_name": 1}], [{}]])
def test_damaged_processors_are_refused(policy: Path, steps: object) -> None:
    (policy / PROCESSORS[1]).write_text(json.dumps({"steps": steps}))
    with pytest.raises(PolicyError, match=PROCESSORS[1]):
        check_steps(policy)


def test_a_link_out_of_a_dataset_is_not_followed(reach_cup: Path, tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("private")
    source = tmp_path / "source"
    shutil.copytree(reach_cup / "erj", source)
    (source / "meta" / "notes.txt").symlink_to(source / "meta" / "info.json")
    check_links(source)
    (source / "meta" / "more.txt").symlink_to(secret)
    with pytest.raises(ErIlError, match=r"more.txt is a link to .*secret, out of .*source"):
        reencode(
            str(source),
            tmp_path / "out",
            "task",
            rotation="quat",
            wirings=(),
            keep=False,
            on_progress=lambda done, total: None,
        )
    assert not list(tmp_path.glob("out*"))
    (source / "meta" / "more.txt").unlink()
    (source / "videos").symlink_to(tmp_path)
    with pytest.raises(ErIlError, match="videos is a link to"):
        check_links(source)


def test_a_snapshot_in_the_hubs_cache_consists_of_links(tmp_path: Path) -> None:
    blob = tmp_path / "datasets--me--cups" / "blobs" / "abc"
    snapshot = tmp_path / "datasets--me--cups" / "snapshots" / "main"
    for folder in (blob.parent, snapshot):
        folder.mkdir(parents=True)
    blob.touch()
    (snapshot / "file").symlink_to(Path("../../blobs/abc"))
    check_links(snapshot)
    (snapshot / "other").symlink_to(tmp_path)
    with pytest.raises(ErIlError, match="other is a link to"):
        check_links(snapshot)
