"""The kinds of experiments: policies that imitate demonstrations, and agents that learn by reinforcement."""

from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from er_il.experiments.agents.grid import MODES, AgentGrid
from er_il.experiments.agents.plan import AgentPlan
from er_il.experiments.grid import Grid, GridError
from er_il.experiments.plan import Plan

if TYPE_CHECKING:
    from er_il.experiments.run import Experiment


def read_plan(path: Path, out: Path, published: Path | None = None) -> Plan | AgentPlan:
    """Read a grid of either kind.

    Args:
        path: A YAML file; grids of agents have ``modes``.
        out: Folder of everything that the experiment makes.
        published: Folder of a report whose cells are taken as they are; only of agents.

    Raises:
        GridError: the file is no grid, or not one of agents though cells are published.
        UnknownNameError: it names what there is not.
        ErIlError: the published report is damaged, or of agents that learnt otherwise.
    """
    if _names_modes(path):
        plan = AgentPlan(AgentGrid.from_file(path), out)
        return plan if published is None else plan.beside(published)
    if published is not None:
        raise GridError(f"{path} is not a grid of agents: only reports of such grids can be added to.")
    return Plan(Grid.from_file(path), out)


def experiment_of(plan: Plan | AgentPlan) -> "Experiment":
    """The experiment of a plan."""
    if isinstance(plan, AgentPlan):
        from er_il.experiments.agents.experiment import Learning  # seconds of imports: mistakes are told before

        return Learning(plan)
    from er_il.experiments.imitation import Imitation

    return Imitation(plan)


def _names_modes(path: Path) -> bool:
    try:
        values = yaml.safe_load(path.read_text())
    except (OSError, ValueError, yaml.YAMLError, RecursionError):
        return False  # reading it as a grid says what is wrong
    return isinstance(values, dict) and MODES in values
