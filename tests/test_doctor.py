import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from documented import documented, run

from er_il.support import machine

NOWHERE = {"DISPLAY": "", "WAYLAND_DISPLAY": "", "CUDA_VISIBLE_DEVICES": ""}


def _verdicts(output: str) -> dict[str, tuple[str, str]]:
    """Check -> verdict and the rest of its line."""
    lines = (re.split(r" {2,}", line.strip(), maxsplit=2) for line in output.splitlines())
    return {line[1]: (line[0], line[2]) for line in lines if line[0] in ("ok", "missing", "optional")}


@pytest.mark.slow
def test_a_machine_without_display_and_gpu_can_run_the_demo(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "er_il", *documented("docs/quickstart.md", "er-il doctor")]
    doctor = subprocess.run(
        command, cwd=tmp_path, env=os.environ | NOWHERE, capture_output=True, text=True, check=False
    )
    assert doctor.stderr == ""
    verdicts = _verdicts(doctor.stdout)
    assert (doctor.returncode, doctor.stdout.splitlines()[-1]) == (0, "er-il demo can run.")
    for name in ("Python", "Robot model", "Rendering", "Output folders", "Video decoding"):
        assert verdicts[name][0] == "ok", name
    assert verdicts["Display for Rerun"][0] == "optional"
    assert "--save" in verdicts["Display for Rerun"][1]
    assert verdicts["GPU"][0] == "optional"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_machine_that_cannot_render_or_write_is_told_how_to(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "policies").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MUJOCO_GL", "nonsense")
    for probe in ("_GPU", "_TORCHCODEC"):  # these import PyTorch for seconds; the test above runs them
        monkeypatch.setattr(machine, probe, "")
    with pytest.raises(AssertionError, match="exits with 1"):
        run("er-il", "doctor")
    output = capfd.readouterr().out
    verdicts = _verdicts(output)
    assert output.splitlines()[-1] == "er-il demo cannot run: Rendering, Output folders."
    verdict, advice = verdicts["Rendering"]
    assert verdict == "missing"
    assert "MUJOCO_GL=nonsense fails" in advice
    assert "export MUJOCO_GL=egl" in advice
    verdict, advice = verdicts["Output folders"]
    assert verdict == "missing"
    assert "policies: Not a directory" in advice
