"""``er-il encode``: the same dataset with its actions in another space."""

from pathlib import Path

from tyro.conf import OmitArgPrefixes, Positional

from er_il.cli.arm_options import ArmOptions, Names


def encode(
    source: Positional[str],
    *,
    to: str,
    out: Path,
    robot: OmitArgPrefixes[ArmOptions],
    redundant: Names = (),
    angle_frames: Names = (),
    rotation: str = "quat",
    weights: Path | None = None,
    chunk: int = 20,
    keep: bool = True,
    repo_id: str = "",
) -> None:
    """Write a LeRobot v3 dataset again with its actions in another action space.

    Videos and all other columns stay as they are; so does the source. A dataset that was encoded
    before knows its arms; to others, say which arm it is and which dimensions are its joints.

    Args:
        source: Folder of the dataset, or its repository id on the hub.
        to: joint, task, erj, era, era@stereo or erx; joint goes back through the decoder to the robot's own joint
            values. With rel_ in front, policies see chunks of these actions relative to the state.
        out: Folder of the new dataset.
        robot: The arm of a dataset that does not know it.
        redundant: Joints of the URDF that erj commands; the first ones if omitted.
        angle_frames: Shoulder, elbow and wrist link, for era; those at which seven joints bend if omitted.
        rotation: quat, rot6d (the first two columns of the rotation matrix) or rot6d_rows (its first two rows).
        weights: File of the weights of erx, which er-il advise --fit erx writes; those of the arm if omitted.
        chunk: Actions of a chunk, of a space with rel_ in front: that of the policy or more.
        keep: Keep the actions as they were, and other columns of actions, in columns source.*, which no policy reads.
        repo_id: Repository id that the dataset will have on the hub: its card then links to LeRobot's visualiser.
    """
    from rich.console import Console

    from er_il.cli.progress import make_progress
    from er_il.datasets.reencoding import reencode
    from er_il.datasets.weights import read_weights

    wirings = robot.wirings(redundant, angle_frames)
    given = read_weights(weights, (to,))
    console = Console()
    with make_progress(console) as progress:
        bar = progress.add_task(f"Encode as {to}", total=None, visible=False)  # until a frame is encoded
        written = reencode(
            source,
            out,
            to,
            rotation=rotation,
            wirings=wirings,
            weights=given,
            keep=keep,
            repo_id=repo_id,
            chunk=chunk,
            on_progress=lambda done, total: progress.update(bar, completed=done, total=total, visible=True),
        )
    names = written.layout.encoded_names
    console.print(f"{out}: {len(names)} dimensions: {', '.join(names)}", highlight=False, soft_wrap=True)
    for note in written.notes:
        console.print(note, highlight=False, soft_wrap=True, markup=False)
    if written.statuses:
        listed = ", ".join(f"{status} {count}" for status, count in written.statuses.most_common())
        console.print(f"Decoded commands by status: {listed}", highlight=False)
    console.print(f"Check it: er-il verify {out}", highlight=False, soft_wrap=True)
