"""``er-il view``: an episode in Rerun."""

from pathlib import Path

from tyro.conf import OmitArgPrefixes, Positional

from er_il.cli.arm_options import ArmOptions


def view(
    source: Positional[Path],
    *,
    robot: OmitArgPrefixes[ArmOptions],
    episode: int | None = None,
    save: Path | None = None,
    spawn: bool = False,
    serve: bool = False,
    address: str = "127.0.0.1",
) -> None:
    """Show an episode in Rerun: the arm in its world, cameras, curves, and the status of each decode.

    Without options the viewer opens on this screen.

    Args:
        source: Folder of a dataset, or the trace (.npz) of a rollout.
        robot: The arm of a dataset that does not know it; of one that knows several, --arm is the label of one.
        episode: Episode of the dataset; the first if omitted.
        save: File (.rrd) to write.
        spawn: Open the viewer on this screen.
        serve: Serve a viewer for browsers.
        address: IP address to serve on. The default is reached from this machine only; anyone who reaches another one
            sees the episode.
    """
    import time
    import webbrowser
    from contextlib import suppress
    from dataclasses import replace

    from rich.console import Console

    from er_il.datasets.dataset import Dataset
    from er_il.support.atomic_files import check_writable
    from er_il.support.display import has_display
    from er_il.viewer.destination import check_address, check_file, require_display
    from er_il.viewer.source import read_source

    console = Console()
    spawn = spawn or not (save or serve)
    if spawn:
        require_display()
    if save:
        check_file(save)
        check_writable(save)
    check_address(address)
    labelled = robot.arms is not None or not source.is_dir() or Dataset(source).specified
    wirings = replace(robot, arm="").wirings() if labelled else robot.wirings()
    trace, shapes = read_source(source, episode, robot.arm if labelled else "", wirings)
    from er_il.viewer import show  # Rerun: a second of imports

    if not shapes:
        console.print("No simulated task made this: the arm is shown without its world.", highlight=False)
    if save:
        show.save_recording(trace, shapes, save)
        console.print(str(save), highlight=False, soft_wrap=True)
    if spawn:
        show.spawn(trace, shapes)
    if serve:
        from er_il.viewer.server import served

        with suppress(KeyboardInterrupt), served(trace, shapes, address) as url:
            console.print(f"{url}\nCtrl-C ends it.", highlight=False, soft_wrap=True)
            if has_display():
                webbrowser.open(url)
            while True:
                time.sleep(1)
