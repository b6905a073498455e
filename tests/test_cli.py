"""The command line as a whole: what it loads before it answers, and how it is left."""

import json
import os
import subprocess
import sys

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


def test_help_and_mistakes_are_answered_before_anything_heavy_is_loaded() -> None:
    asked = subprocess.run(
        [sys.executable, "-c", ASK, json.dumps(list(ANSWERED))], capture_output=True, text=True, check=True
    )
    codes, loaded = json.loads(asked.stdout.splitlines()[-1])
    assert dict(zip(ANSWERED, codes, strict=True)) == ANSWERED
    assert HEAVY.isdisjoint(loaded), HEAVY & set(loaded)
    for command in cli.COMMANDS:
        assert command in asked.stdout


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
