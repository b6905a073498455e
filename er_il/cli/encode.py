"""``er-il encode``: the same dataset with its actions in another space."""

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

Names = Annotated[tuple[str, ...], arg(metavar="NAME ...")]
Numbers = Annotated[tuple[float, ...], arg(metavar="X ...")]


def encode(
    source: Positional[str],
    *,
    to: str,
    out: Path,
    arm: str = "",
    ee_frame: str = "",
    base_frame: str = "",
    joints: Names = (),
    state_joints: Names = (),
    units: str = "rad",
    signs: Numbers = (),
    offsets: Numbers = (),
    urdf_joints: Names = (),
    redundant: Names = (),
    angle_frames: Names = (),
    arms: Path | None = None,
    rotation: str = "quat",
    keep: bool = True,
) -> None:
    """Write a LeRobot v3 dataset again with its actions in another action space.

    Videos and all other columns stay as they are; so does the source. A dataset that was encoded
    before knows its arms; to others, say which arm it is and which dimensions are its joints.

    Args:
        source: Folder of the dataset, or its repository id on the hub.
        to: joint, task, erj or era; joint goes back through the decoder to the robot's own joint values.
        out: Folder of the new dataset.
        arm: Preset (panda, panda8, xarm7), or path of a URDF.
        ee_frame: Link whose pose the actions command; a URDF needs it.
        base_frame: Link in which poses are expressed; the URDF's root if omitted.
        joints: Dimensions of the action that are the arm's joints, base first; found by the arm's joint names if
            omitted. All other dimensions, such as the gripper, are passed through.
        state_joints: The same of observation.state; those of the same names if omitted.
        units: Units of the joints in the dataset: rad or deg.
        signs: 1 or -1 for each joint: the URDF's angle is sign * value + offset.
        offsets: Offset of each joint, in the dataset's units.
        urdf_joints: Joints of the URDF, base first; all between base and end effector if omitted.
        redundant: Joints of the URDF that erj commands; the first ones if omitted.
        angle_frames: Shoulder, elbow and wrist link, which era needs.
        arms: YAML file with one entry an arm, for several arms, in place of the options above.
        rotation: quat or rot6d.
        keep: Keep the actions as they were in a column source.action, which no policy reads.
    """
    from rich.console import Console

    from er_il.cli.progress import make_progress
    from er_il.data.wiring import Wiring, read_wirings
    from er_il.errors import DatasetError

    if arms is not None and arm:
        raise DatasetError("Give either --arm or --arms.")
    wirings = read_wirings(arms) if arms else []
    if arm:
        wirings = [
            Wiring(
                arm,
                ee_frame=ee_frame,
                base_frame=base_frame,
                urdf_joints=urdf_joints,
                redundant=redundant,
                angle_frames=angle_frames,
                joints=joints,
                state_joints=state_joints,
                units=units,
                signs=signs,
                offsets=offsets,
            )
        ]
        wirings[0].build_arm()  # wrong options are told before seconds of imports

    from er_il.data.reencoding import reencode

    console = Console()
    with make_progress(console) as progress:
        bar = progress.add_task(f"Encode as {to}", total=None)
        written = reencode(
            source,
            out,
            to,
            rotation=rotation,
            wirings=wirings,
            keep=keep,
            on_progress=lambda done, total: progress.update(bar, completed=done, total=total),
        )
    names = written.layout.encoded_names
    console.print(f"{out}: {len(names)} dimensions: {', '.join(names)}", highlight=False, soft_wrap=True)
    if written.statuses:
        listed = ", ".join(f"{status} {count}" for status, count in written.statuses.most_common())
        console.print(f"Decoded commands by status: {listed}", highlight=False)
    console.print(f"Check it: er-il verify {out}", highlight=False, soft_wrap=True)
