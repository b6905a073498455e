"""The links and joints of a robot file, checked here: the kinematics libraries crash on, or misread, what is wrong."""

import math
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

from er_il.support.errors import ArmError

TURN = 2.0 * math.pi  # [rad] a continuous joint gets limits of one turn to either side
REVOLUTE, CONTINUOUS, FIXED = "revolute", "continuous", "fixed"
KINDS = (REVOLUTE, CONTINUOUS, FIXED, "prismatic", "planar", "floating")

LINKS = 1000  # more than any robot has; Pinocchio needs minutes for ten times as many
REACH = 1000.0  # [m] between two joints: more is in other units
TURNS = 1000.0  # of a joint with limits
RESERVED = ("universe", "root_joint")  # Pinocchio's and Placo's own: Placo leaves joints of these names out


@dataclass(frozen=True)
class TreeJoint:
    """A joint, with what its element says of it."""

    name: str
    kind: str
    parent: str
    child: str
    element: ET.Element

    @property
    def numbers(self) -> Mapping[str, str]:
        """What its limits say."""
        limit = self.element.find("limit")
        return {} if limit is None else limit.attrib


@dataclass(frozen=True, eq=False)
class RobotTree:
    """A single tree of links, each but the root's behind one joint."""

    name: str
    file: str  # for messages
    links: tuple[str, ...]  # in the file's order
    joints: tuple[TreeJoint, ...]  # likewise

    @classmethod
    def of_element(cls, robot: ET.Element, file: str) -> "RobotTree":
        """Check the element ``<robot>`` of a file.

        Raises:
            ArmError: it describes no single tree: names what is wrong.
        """
        links = tuple(link.get("name", "") for link in robot.findall("link"))
        tree = cls(robot.get("name", "arm"), file, links, tuple(_joint(each, file) for each in robot.findall("joint")))
        tree._check_names()
        tree._check_tree()
        for joint in tree.joints:
            _check_origin(joint, file)
        return tree

    @property
    def root(self) -> str:
        """The link that no joint moves."""
        return next(link for link in self.links if link not in self._above)

    @property
    def tips(self) -> list[str]:
        """The links that carry no joint."""
        carrying = {joint.parent for joint in self.joints}
        return [link for link in self.links if link not in carrying]

    def joint(self, name: str) -> TreeJoint:
        """The joint of that name."""
        return next(joint for joint in self.joints if joint.name == name)

    def chain(self, base: str, ee: str) -> tuple[TreeJoint, ...]:
        """Joints that move the link ``ee`` but not the link ``base``, base first, without fixed ones."""
        below = self._path(base)
        return tuple(joint for joint in self._path(ee) if joint not in below and joint.kind != FIXED)

    def arm_xml(self, movable: Collection[str]) -> str:
        """Return what kinematics needs, as XML: every joint outside ``movable`` is fixed, continuous ones have limits.

        Raises:
            ArmError: a movable joint does not turn, or lacks an axis or limits.
        """
        robot = ET.Element("robot", name=self.name)
        for link in self.links:
            ET.SubElement(robot, "link", name=link)
        for joint in self.joints:
            moves = joint.name in movable
            element = ET.SubElement(robot, "joint", name=joint.name, type=REVOLUTE if moves else FIXED)
            ET.SubElement(element, "parent", link=joint.parent)
            ET.SubElement(element, "child", link=joint.child)
            if (origin := joint.element.find("origin")) is not None:
                ET.SubElement(
                    element, "origin", {key: origin.attrib[key] for key in ("xyz", "rpy") if key in origin.attrib}
                )
            if moves:
                self._check_turning(joint)
                if (axis := joint.element.find("axis")) is not None:
                    ET.SubElement(element, "axis", xyz=axis.get("xyz", ""))
                turn = {"lower": str(-TURN), "upper": str(TURN)} if joint.kind == CONTINUOUS else {}
                ET.SubElement(element, "limit", {"effort": "0", "velocity": "0", **joint.numbers, **turn})
        return ET.tostring(robot, encoding="unicode")

    @cached_property
    def _above(self) -> dict[str, TreeJoint]:
        """The joint that moves each link but the root."""
        return {joint.child: joint for joint in self.joints}

    def _path(self, link: str) -> list[TreeJoint]:
        """All joints from the root to a link."""
        path: list[TreeJoint] = []
        while link in self._above:
            path.append(self._above[link])
            link = path[-1].parent
        return path[::-1]

    def _check_names(self) -> None:
        if len(self.links) > LINKS:
            raise ArmError(f"{self.file} has {len(self.links)} links; an arm has no more than {LINKS}.")
        if not all(self.links) or not all(joint.name for joint in self.joints):
            raise ArmError(f"{self.file} has a link or a joint without a name.")
        for what, names in (("link", self.links), ("joint", [joint.name for joint in self.joints])):
            if twice := [name for name, count in Counter(names).items() if count > 1]:
                raise ArmError(f"{self.file} has several {what}s named {', '.join(twice)}.")
        known = set(self.links)
        if reserved := known.intersection(RESERVED):
            raise ArmError(f"{self.file} has a link named {', '.join(reserved)}: rename it, the solver needs the name.")
        if mistaken := [joint.name for joint in self.joints if joint.name in known and joint.name != joint.child]:
            raise ArmError(f"{self.file} has a joint and a link named {', '.join(mistaken)} in different places.")

    def _check_tree(self) -> None:
        for joint in self.joints:
            for role, link in (("parent", joint.parent), ("child", joint.child)):
                if link not in self.links:
                    said = f"a {role} link {link!r}, which is not there" if link else f"no {role} link"
                    raise ArmError(f"{self.file}: the joint {joint.name} has {said}.")
        if several := [link for link, count in Counter(joint.child for joint in self.joints).items() if count > 1]:
            raise ArmError(f"{self.file} describes no single tree of links: several joints move {', '.join(several)}.")
        roots = [link for link in self.links if link not in self._above]
        if len(roots) > 1:
            raise ArmError(f"{self.file} describes no single tree of links: no joint moves {', '.join(roots)}.")
        reached, waiting = set(), list(roots)
        carried: dict[str, list[str]] = {}
        for joint in self.joints:
            carried.setdefault(joint.parent, []).append(joint.child)
        while waiting:
            reached.add(link := waiting.pop())
            waiting += carried.get(link, [])
        if loop := [link for link in self.links if link not in reached]:
            raise ArmError(f"{self.file} describes no single tree of links: {', '.join(loop)} form a loop.")

    def _check_turning(self, joint: TreeJoint) -> None:
        """Refuse what cannot be a joint of an arm."""
        said = f"{self.file}: the joint {joint.name}"
        if joint.name in RESERVED:
            raise ArmError(f"{said} needs another name: the solver has a joint of this name itself.")
        if joint.kind not in (REVOLUTE, CONTINUOUS):
            raise ArmError(
                f"{said} is {joint.kind}; er_il's arms have joints that turn. Name those: others stay at zero."
            )
        axis = joint.element.find("axis")
        if axis is not None and not any(_numbers(axis, "xyz", 3, said)):
            raise ArmError(f"{said} has an axis of length zero.")
        if (limit := joint.element.find("limit")) is None:
            raise ArmError(f"{said} has no limits.")
        values = {
            key: _numbers(limit, key, 1, said)[0]
            for key in ("lower", "upper", "velocity", "effort")
            if key in limit.attrib
        }
        lower, upper = values.get("lower", 0.0), values.get("upper", 0.0)
        limited = joint.kind == CONTINUOUS or -TURNS * TURN < lower < upper < TURNS * TURN
        if not limited or not values.get("velocity", 0.0) > 0:
            raise ArmError(
                f"{said} is limited to [{lower:g}, {upper:g}] rad and {values.get('velocity', 0.0):g} rad/s: every arm "
                f"joint needs lower < upper, within {TURNS:g} turns, and a velocity limit > 0."
            )


def _joint(element: ET.Element, file: str) -> TreeJoint:
    name, kind = element.get("name", ""), element.get("type", "")
    if kind not in KINDS:
        raise ArmError(f"{file}: the joint {name} is of the type {kind!r}. Valid: {', '.join(KINDS)}.")
    parent, child = ("" if (end := element.find(role)) is None else end.get("link", "") for role in ("parent", "child"))
    return TreeJoint(name, kind, parent, child, element)


def _check_origin(joint: TreeJoint, file: str) -> None:
    origin = joint.element.find("origin")
    if origin is None:
        return
    said = f"{file}: the joint {joint.name}"
    for key in ("xyz", "rpy"):
        if key in origin.attrib:
            values = _numbers(origin, key, 3, said)
            if key == "xyz" and max(map(abs, values)) > REACH:
                raise ArmError(f"{said} lies {max(map(abs, values)):g} m from the one before. URDFs are in metres.")


def _numbers(element: ET.Element, key: str, count: int, said: str) -> list[float]:
    text = element.get(key, "")
    try:
        values = [float(each) for each in text.split()]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        needed = f"{count} finite numbers" if count > 1 else "one finite number"
        raise ArmError(f"{said} has {key}={text!r} in <{element.tag}>; it needs {needed}.")
    return values
