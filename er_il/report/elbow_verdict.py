"""What an audit recommends, by thresholds."""

from typing import Any

import numpy as np

from er_il.evaluation.task_drift import DECODERS
from er_il.report.margins import FITTED
from er_il.report.text import Report
from er_il.spaces.registry import ERA

SAME = 0.05  # [m] an elbow no farther from the recorded one, half the thickness of a forearm, is at the same place,
STEPS = 95  # in this percentage of the steps
FOLLOWED = 0.99  # share of the poses that a decoder must meet
COVERED = 0.3  # share of the frames that another episode must come near, or nothing is known of the elbow's spread
OPEN = 0.1  # share of the elbow's freedom that pose and time may leave open, for it to have been demonstrated
MARGIN, RISK = 0.1, 0.01  # smallest margin, and largest share of steps at risk, of a space that is recommended
ODD = 3.0  # an episode whose elbow differs by this factor more than the median one's, and by more than SAME, is odd

TASK_ENOUGH, DEMONSTRATED, ARBITRARY, UNKNOWN = "task_enough", "demonstrated", "arbitrary", "unknown"


def verdict(report: Report) -> dict[str, Any]:
    """The recommendation, and the thresholds that it follows from."""
    drift, spread = report["drift"], report["spread"]
    decoder = min(DECODERS, key=lambda name: (drift[name]["followed"] < FOLLOWED, drift[name]["elbow_m"][f"p{STEPS}"]))
    best = drift[decoder]
    timed = spread["given_pose_and_time"] or spread["given_pose"]
    if best["followed"] >= FOLLOWED and best["elbow_m"][f"p{STEPS}"] <= SAME:
        case = TASK_ENOUGH
    elif timed is None or spread["covered"] < COVERED:
        case = UNKNOWN
    else:
        case = DEMONSTRATED if timed["open"] <= OPEN else ARBITRARY
    differences = spread["of_episode_m"]
    usual = float(np.median([each for each in differences if each is not None] or [0.0]))
    odd = [
        each["episode"]
        for each, difference in zip(report["episodes"], differences, strict=True)
        if difference is not None and difference > max(SAME, ODD * usual)
    ]
    return {
        "case": case,
        "decoder": decoder,
        "space": _space(report),
        "odd_episodes": odd,
        "thresholds": {
            "same_m": SAME,
            "steps": STEPS,
            "followed": FOLLOWED,
            "covered": COVERED,
            "open": OPEN,
            "margin": MARGIN,
            "risk": RISK,
            "odd": ODD,
        },
    }


def _space(report: Report) -> str:
    """The first suitable space, as the report labels it: ERJ by its best joints, ERX, ERA; "" if none is."""
    rows = {row["space"]: row for row in report["spaces"]}
    for name in (report["best_joints"], FITTED, ERA):
        if name in rows and rows[name]["smallest"] >= MARGIN and rows[name]["risk"] <= RISK:
            return name
    return ""
