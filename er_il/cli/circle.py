"""``er-il circle``: elbow drift while the end effector repeats a circle."""

from pathlib import Path

from er_il.cli.table import write_study


def circle(*, arm: str = "panda", out: Path = Path("outputs/circle")) -> None:
    """Lead an arm's end effector around a circle, lap after lap, and measure the drift of its elbow.

    The same poses are solved by LeRobot's own inverse kinematics and in er_il's action spaces.

    Args:
        arm: Preset of the arm.
        out: Folder of report.json and circle.png.
    """
    from rich.console import Console

    from er_il.arms.arm import Arm
    from er_il.support.atomic_files import check_writable

    check_writable(out)
    subject = Arm.preset(arm)  # seconds of imports follow: mistakes are told before
    from er_il.experiments.studies.circle import study_circle
    from er_il.report.circle import circle_figure
    from er_il.report.tables import terminal_table
    from er_il.report.text import table
    from er_il.support.provenance import provenance

    console = Console()
    with console.status("Solving along the circle"):
        report = study_circle(subject)
    report["meta"] = provenance() | report["meta"]
    texts = table("drift", **report)
    shown = terminal_table(texts.rename(columns=lambda heading: heading.replace("Elbow drift after lap", "Lap")))
    shown.title = "Elbow drift"
    console.print(shown)
    write_study(report, out, console, {"circle.png": circle_figure})
