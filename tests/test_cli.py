"""The command line as a whole: what it loads before it answers, and how it is left."""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from er_il import cli
from er_il.cli import INTERRUPTED, USER_MISTAKE, main

# What takes long to import: help and mistakes are answered without any of it.
HEAVY = {"gymnasium", "lerobot", "matplotlib", "mujoco", "numpy", "pandas", "pinocchio", "placo", "pydantic"}
HEAVY |= {"rerun", "scipy", "sim_tasks", "torch"}

ANSWERED = {
    ("--help",): 0,
    ("generate", "--help"): 0,
    ("study", "joints", "--help"): 0,
    (): USER_MISTAKE,
    ("record",): USER_MISTAKE,
    ("eval", "policies/reach_cup/erj"): USER_MISTAKE,
    ("generate", "reach_cup", "--episodes", "many"): USER_MISTAKE,
}
# Mistakes that only kinematics, worlds or files tell: without LeRobot and torch, whose import takes seconds.
TOLD = (
    ("advise", "nothing_here"),
    ("attach", "{golden}/policy", "--out", "copy", "--dataset", "nowhere"),
    ("attach", "{golden}/policy", "--out", "{golden}", "--dataset", "{golden}/push_button_elbow/erj"),
    ("benchmark", "absent.yaml"),
    ("circle", "--arm", "pandu"),
    ("demo", "--decoders", "task"),
    ("demo", "--out", "{golden}"),
    ("encode", "nowhere", "--to", "erj", "--out", "new"),
    ("encode", "{golden}/push_button_elbow/erj", "--to", "polar", "--out", "new"),
    ("encode", "{golden}/push_button_elbow/erj", "--to", "task", "--out", "{golden}"),
    ("eval", "nowhere", "--task", "reach_cup", "--decoder", "erj"),
    ("eval", "{golden}/policy", "--task", "reach_cap", "--decoder", "erj"),
    ("eval", "{golden}/policy", "--task", "push_button_elbow", "--decoder", "joint"),
    ("eval", "{golden}/policy", "--task", "push_button_elbow", "--decoder", "erj", "--episodes", "0"),
    ("generate", "reach_cup", "--spaces", "polar", "--out", "new"),
    ("generate", "reach_cup", "--cameras", "elbow", "--out", "new"),
    ("generate", "push_button_elbow", "--seed", "9", "--out", "{golden}/push_button_elbow"),
    ("replay", "sweep"),
    ("retarget", "nowhere", "--to", "xarm7", "--out", "new"),
    ("retarget", "{golden}/push_button_elbow/erj", "--to", "polar", "--out", "new"),
    ("retarget", "{golden}/push_button_elbow/erj", "--to", "xarm7", "--out", "{golden}"),
    ("study", "joints", "nowhere"),
    ("study", "joints", "--training", "absent.json"),
    ("train", "reach_cup", "erj", "--dataset", "nowhere"),
    ("verify", "nowhere"),
    ("view", "nowhere", "--save", "new.rrd"),
    ("view", "{golden}/push_button_elbow/erj", "--save", "new.txt"),
    ("view", "{golden}/push_button_elbow/erj", "--episode", "99", "--save", "new.rrd"),
)
ASK = """
import json, sys
from er_il.cli import main
codes = []
for arguments in json.loads(sys.argv[1]):
    sys.argv = ["er-il", *arguments]
    try:
        main()
    except SystemExit as left:
        codes.append(left.code or 0)
print(json.dumps([codes, sorted({name.partition(".")[0] for name in sys.modules})]))
"""


def ask(commands: Sequence[Sequence[str]]) -> tuple[subprocess.CompletedProcess[str], list[int], set[str]]:
    """Run commands in one process; return what it printed, their exit codes and the packages that it loaded."""
    asked = subprocess.run(
        [sys.executable, "-c", ASK, json.dumps(commands)], capture_output=True, text=True, check=True
    )
    codes, loaded = json.loads(asked.stdout.splitlines()[-1])
    return asked, codes, set(loaded)


def test_help_and_mistakes_are_answered_before_anything_heavy_is_loaded() -> None:
    asked, codes, loaded = ask(list(ANSWERED))
    assert dict(zip(ANSWERED, codes, strict=True)) == ANSWERED
    assert HEAVY.isdisjoint(loaded), HEAVY & loaded
    for command in cli.COMMANDS:
        assert command in asked.stdout


def test_mistakes_are_told_before_lerobot_is_loaded(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    golden = Path(__file__).parent / "golden"
    asked, codes, loaded = ask([[argument.format(golden=golden) for argument in command] for command in TOLD])
    assert dict(zip(TOLD, codes, strict=True)) == dict.fromkeys(TOLD, USER_MISTAKE), asked.stderr
    assert asked.stderr.count("error: ") == len(TOLD)
    assert loaded.isdisjoint({"lerobot", "torch"})
    assert list(tmp_path.iterdir()) == []


def test_an_interruption_while_a_command_is_loaded_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(name: str, module: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "_command", interrupted)
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == INTERRUPTED
    assert capsys.readouterr().err == "Interrupted. The same command resumes.\n"


def test_a_reader_that_has_seen_enough_ends_a_command_quietly() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    asked = subprocess.run(
        [sys.executable, "-m", "er_il", "--help"], stdout=writer, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(writer)
    assert (asked.returncode, asked.stderr) == (1, "")
