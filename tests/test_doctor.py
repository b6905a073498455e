import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

NOWHERE = {"DISPLAY": "", "WAYLAND_DISPLAY": "", "CUDA_VISIBLE_DEVICES": ""}


def _verdicts(output: str) -> dict[str, tuple[str, str]]:
    """Check -> verdict and the rest of its line."""
    lines = (re.split(r" {2,}", line.strip(), maxsplit=2) for line in output.splitlines())
    return {line[1]: (line[0], line[2]) for line in lines if line[0] in ("ok", "missing", "optional")}


def _doctor(folder: Path, **environment: str) -> tuple[int, dict[str, tuple[str, str]], str]:
    command = [sys.executable, "-m", "er_il", "doctor"]
    run = subprocess.run(
        command, cwd=folder, env=os.environ | NOWHERE | environment, capture_output=True, text=True, check=False
    )
    assert run.stderr == ""
    return run.returncode, _verdicts(run.stdout), run.stdout.splitlines()[-1]


@pytest.mark.slow
def test_a_machine_without_display_and_gpu_can_run_the_demo(tmp_path: Path) -> None:
    code, verdicts, last = _doctor(tmp_path)
    assert (code, last) == (0, "er-il demo can run.")
    for name in ("Python", "Robot model", "Rendering", "Output folders", "Video decoding"):
        assert verdicts[name][0] == "ok", name
    assert verdicts["Display for Rerun"][0] == "optional"
    assert "--save" in verdicts["Display for Rerun"][1]
    assert verdicts["GPU"][0] == "optional"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_machine_that_cannot_render_or_write_is_told_how_to(tmp_path: Path) -> None:
    (tmp_path / "policies").touch()
    code, verdicts, last = _doctor(tmp_path, MUJOCO_GL="nonsense")
    assert (code, last) == (1, "er-il demo cannot run: Rendering, Output folders.")
    verdict, advice = verdicts["Rendering"]
    assert verdict == "missing"
    assert "MUJOCO_GL=nonsense fails" in advice
    assert "export MUJOCO_GL=egl" in advice
    verdict, advice = verdicts["Output folders"]
    assert verdict == "missing"
    assert "policies: Not a directory" in advice
