"""``er-il circle``: where the elbow goes while the hand repeats itself."""

from pathlib import Path


def circle(*, arm: str = "panda", out: Path = Path("outputs/circle")) -> None:
    """Lead an arm's hand around a circle, lap after lap, and watch its elbow.

    The same poses are solved by LeRobot's own inverse kinematics and in er_il's action spaces.

    Args:
        arm: Preset of the arm.
        out: Folder of report.json and circle.png.
    """
    from rich.console import Console
    from rich.table import Table

    from er_il.arms.arm import Arm
    from er_il.experiments.studies.circle import NAMES, drive_all, write_report
    from er_il.report.circle_plot import plot

    console = Console()
    chosen = Arm.preset(arm)
    with console.status("Around the circle"):
        drives = drive_all(chosen)
    laps = range(1, len(drives[0].drift) + 1)
    table = Table("elbow from its start [cm]", *(f"lap {lap}" for lap in laps), "hand off by [mm]")
    for drive in drives:
        drift = [f"{100 * each:.1f}" for each in drive.drift]
        table.add_row(NAMES[drive.solver], *drift, f"{1e3 * drive.position_error:.2f}")
    console.print(table)
    write_report(chosen, drives, out / "report.json")
    plot(chosen, drives, out / "circle.png")
    console.print(f"{out / 'report.json'}\n{out / 'circle.png'}", highlight=False, soft_wrap=True)
