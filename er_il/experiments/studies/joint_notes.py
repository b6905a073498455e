"""What a study of joints says in words, from its numbers alone."""

from collections.abc import Mapping, Sequence
from typing import Any

Report = Mapping[str, Any]

UNFIT = 0.4  # risk of a choice along demonstrations above which it breaks
SHOWN = 5  # stretches near singularities that are named


def notes(report: Report) -> list[str]:
    """Sentences that say which joints to command, why, what to avoid, and where to take care."""
    return [*_recommendation(report), *_structure(report), *_unfit(report), *_singularities(report), *_next(report)]


def joined(choice: Sequence[str]) -> str:
    """A choice's name: ``panda_joint1``, or ``joint1 + joint3``."""
    return " + ".join(choice)


def risks(report: Report) -> dict[str, float]:
    """Risk of each choice: its mean over the demonstrations if there are any, else over the workspace."""
    sets = list(report["demos"].values()) or [report["workspace"]]
    return {
        joined(each["joints"]): sum(of_set[i]["risk"] for of_set in sets) / len(sets) for i, each in enumerate(sets[0])
    }


def training_notes(report: Report) -> list[str]:
    """Sentences that compare the advice with policies that were trained, if there are any: a task each."""
    return [
        f"Trained on {each['task']}: the advised choice, {each['top_choice']}, is "
        f"{'' if each['top_choice_is_best'] else 'not '}the best; rank correlation of low risk with success: "
        + ("none, all do alike" if each["rank_correlation"] is None else f"{each['rank_correlation']:.2f}")
        + ". "
        + ", ".join(f"{row['joints']} {row['successes']}/{row['episodes']}" for row in each["choices"])
        + "."
        for each in report.get("training", [])
    ]


def _recommendation(report: Report) -> list[str]:
    best, second = (joined(choice) for choice in report["ranking"][:2])
    risk, where = risks(report), "of the workspace"
    said = "is near a singularity"
    if report["demos"]:
        where, said = f"of the steps of {', '.join(report['demos'])}", "are near a singularity or lose the joints"
    missed = _fitness(report["workspace"], report["recommended"])["missed"]
    return [
        f"Command {best}: {risk[best]:.1%} {where} {said}; with the next best, {second}, {risk[second]:.1%}.",
        f"Over the workspace {1 - missed:.1%} of its round trips return the joints.",
    ]


def _structure(report: Report) -> list[str]:
    """Where the redundancy lies, if joints of one kind carry more of it than any of the other."""
    if any(len(each["joints"]) != 1 for each in report["workspace"]):
        return []
    shares = {each["joints"][0]: each["self_motion"] for each in report["workspace"]}
    twisting = [joint for joint in shares if joint in report["twisting"]]
    bending = [joint for joint in shares if joint not in report["twisting"]]
    if not twisting or not bending or min(shares[j] for j in twisting) <= max(shares[j] for j in bending):
        return []
    low, high = (pick(shares[joint] for joint in twisting) for pick in (min, max))
    least, most = (pick(shares[joint] for joint in bending) for pick in (min, max))
    return [
        f"The redundancy lies among the joints that twist, {', '.join(twisting)}: self-motion turns them at {low:.2f} "
        f"to {high:.2f} of its speed on average, those that bend, {', '.join(bending)}, at {least:.2f} to {most:.2f}. "
        "Held, a bending joint leaves the others little to go on with."
    ]


def _unfit(report: Report) -> list[str]:
    if not report["demos"]:
        return []
    unfit = {name: risk for name, risk in risks(report).items() if risk >= UNFIT}
    return [f"Breaks here: {', '.join(f'{name} ({risk:.0%})' for name, risk in unfit.items())}."] if unfit else []


def _singularities(report: Report) -> list[str]:
    if not report["demos"]:
        return []
    near = report["near_singularity"]
    best = [_fitness(of_set, report["recommended"]) for of_set in report["demos"].values()]
    smallest = min(each["smallest_p05"] for each in best)
    if not near:
        found = [
            f"No demonstration comes near a singularity of it (5 % of the steps are below {smallest:.3f}, "
            f"near is below {report['settings']['singular']})."
        ]
    else:
        named = "; ".join(
            f"{each['demos']} episode {each['episode']}, steps {each['first']} to {each['last']} "
            f"(smallest singular value {each['smallest']:.4f})"
            for each in near[:SHOWN]
        )
        more = f"; and {len(near) - SHOWN} more" if len(near) > SHOWN else ""
        found = [f"Take care near its singularities on the way: {named}{more}."]
    folds = sum(each["folds"] for each in best) / len(best)
    if folds:
        found.append(f"A demonstration crosses {folds:.1f} of its folds on average, where solutions meet and may swap.")
    return found


def _next(report: Report) -> list[str]:
    if report["recommended"] == report["default"]:
        return ["It is what erj commands on this arm by default."]
    default, name = joined(report["default"]), f"erj@{'+'.join(report['recommended'])}"
    return [f"By default erj commands {default} on this arm ({risks(report)[default]:.1%}): ask for {name}."]


def _fitness(of_set: Sequence[Mapping[str, Any]], choice: Sequence[str]) -> Mapping[str, Any]:
    return next(each for each in of_set if list(each["joints"]) == list(choice))
