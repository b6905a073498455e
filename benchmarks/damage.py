"""Damage to files: strategies that draw how a file is spoilt, and functions that spoil it."""

import json
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from hypothesis import strategies as st

Damage = tuple[str, Callable[[Path], None]]  # in words, and what does it to a file

VALUES = [
    None,
    "",
    "x",
    -1,
    0,
    3,
    1e30,
    -1e30,
    float("nan"),
    float("inf"),
    2**70,
    [],
    {},
    [[]],
    True,
    "../../etc/passwd",
]
NUMBERS = [np.nan, np.inf, -np.inf, 1e30, -1e30, 200.0]
JOINT_TYPES = ["prismatic", "floating", "planar", "continuous", "fixed", "revolute", "screw", ""]


@st.composite
def damage(draw: st.DrawFn, kind: str) -> Damage:
    """Draw damage that fits a file of this suffix."""
    own = {".json": json_damage, ".parquet": table_damage, ".urdf": robot_damage, ".yaml": line_damage}
    of_kind = own.get(kind)
    return draw(of_kind() if of_kind and draw(st.integers(0, 3)) else bytes_damage())


@st.composite
def bytes_damage(draw: st.DrawFn) -> Damage:
    """Damage that any file can take."""
    share, value = draw(st.floats(0, 1, exclude_max=True)), draw(st.binary(min_size=1, max_size=64))

    def cut(path: Path) -> None:
        content = path.read_bytes()
        path.write_bytes(content[: int(share * len(content))])

    def overwrite(path: Path) -> None:
        content = bytearray(path.read_bytes())
        at = int(share * len(content))
        content[at : at + len(value)] = value
        path.write_bytes(bytes(content))

    def folder(path: Path) -> None:
        path.unlink()
        path.mkdir()

    return draw(
        st.sampled_from(
            [
                (f"cut at {share:.0%}", cut),
                (f"{len(value)} bytes overwritten at {share:.0%}", overwrite),
                ("deleted", lambda path: path.unlink()),
                ("empty", lambda path: path.write_bytes(b"")),
                ("a folder", folder),
                ("zeros", lambda path: path.write_bytes(bytes(path.stat().st_size))),
            ]
        )
    )


@st.composite
def json_damage(draw: st.DrawFn) -> Damage:
    """An entry of a JSON file, at any depth, removed or replaced."""
    at, value, remove = draw(st.floats(0, 1, exclude_max=True)), draw(st.sampled_from(VALUES)), draw(st.booleans())

    def replace(path: Path) -> None:
        document = json.loads(path.read_text())
        entries = list(_entries(document))
        if not entries:
            path.write_text(json.dumps(value))
            return
        container, key = entries[int(at * len(entries))]
        if remove:
            del container[key]
        else:
            container[key] = value
        path.write_text(json.dumps(document))

    return (f"entry at {at:.0%} {'removed' if remove else f'is {value!r}'}", replace)


def _entries(document: Any) -> Iterator[tuple[Any, Any]]:
    """Containers and keys of all entries below a JSON value."""
    keys = document if isinstance(document, dict) else range(len(document)) if isinstance(document, list) else ()
    for key in list(keys):
        yield document, key
        yield from _entries(document[key])


@st.composite
def table_damage(draw: st.DrawFn) -> Damage:
    """A column of a Parquet file spoilt, or rows lost."""
    column, row = draw(st.floats(0, 1, exclude_max=True)), draw(st.floats(0, 1, exclude_max=True))
    number, how = (
        draw(st.sampled_from(NUMBERS)),
        draw(st.sampled_from(["value", "column", "drop", "text", "rows", "degrees"])),
    )

    def spoil(path: Path) -> None:
        table = pq.read_table(path)
        index = int(column * table.num_columns)
        if how == "rows":
            pq.write_table(table.slice(0, int(row * len(table))), path)
        elif how == "drop":
            pq.write_table(table.remove_column(index), path)
        elif how == "text":
            pq.write_table(table.set_column(index, table.field(index).name, pa.array(["x"] * len(table))), path)
        else:
            _write_numbers(table, index, path)

    def _write_numbers(table: pa.Table, index: int, path: Path) -> None:
        field = table.field(index)
        if not (pa.types.is_fixed_size_list(field.type) or pa.types.is_list(field.type)) or not len(table):
            pq.write_table(table.slice(0, len(table) // 2), path)
            return
        rows = np.array(table.column(index).to_pylist(), dtype=np.float64)
        if how == "degrees":
            rows = np.degrees(rows)
        elif how == "column":
            rows[..., -1] = number
        else:
            rows[int(row * len(rows))] = number
        with np.errstate(over="ignore"):
            values = pa.array(list(rows), type=pa.list_(pa.float64())).cast(field.type, safe=False)
        pq.write_table(table.set_column(index, field, values), path)

    return (f"column at {column:.0%}: {how} {number} at {row:.0%}", spoil)


@st.composite
def robot_damage(draw: st.DrawFn) -> Damage:
    """An element of a robot description changed, removed or repeated."""
    at, how = (
        draw(st.floats(0, 1, exclude_max=True)),
        draw(st.sampled_from(["type", "attribute", "remove", "repeat", "mimic"])),
    )
    value = draw(st.sampled_from(["", "nan", "inf", "1e400", "-1", "0 0 0", "0 0", "x", "panda_link0", "panda_link7"]))
    kind = draw(st.sampled_from(JOINT_TYPES))

    def change(path: Path) -> None:
        tree = ET.parse(path)
        pairs = [(parent, child) for parent in tree.iter() for child in parent]
        joints = [pair for pair in pairs if pair[1].tag == "joint" and pair[1].get("type")]
        chosen = joints if how in ("type", "mimic") else [pair for pair in pairs if pair[1].attrib]
        parent, child = chosen[int(at * len(chosen))]
        if how == "type":
            child.set("type", kind)
        elif how == "mimic":
            ET.SubElement(child, "mimic", joint=joints[0][1].get("name", ""))
        elif how == "attribute":
            names = sorted(child.attrib)
            child.set(names[int(at * 997) % len(names)], value)
        elif how == "remove":
            parent.remove(child)
        else:
            parent.append(child)
        tree.write(path)

    return (f"element at {at:.0%}: {how} {kind if how == 'type' else value if how == 'attribute' else ''}", change)


@st.composite
def line_damage(draw: st.DrawFn) -> Damage:
    """A line of a text file replaced, removed or repeated."""
    at, value = draw(st.floats(0, 1, exclude_max=True)), draw(st.sampled_from(VALUES))
    how = draw(st.sampled_from(["value", "key", "remove", "repeat", "tag"]))

    def change(path: Path) -> None:
        lines = path.read_text().splitlines()
        index = int(at * len(lines))
        key, _, old = lines[index].partition(":")
        tag = "!!python/object/apply:os.system ['touch executed']"
        new = {
            "value": [f"{key}: {json.dumps(value)}"],
            "key": [f"x{key}:{old}"],
            "remove": [],
            "repeat": [lines[index]] * 2,
        }
        lines[index : index + 1] = new.get(how, [f"{key}: {tag}"])
        path.write_text("\n".join(lines) + "\n")

    return (f"line at {at:.0%}: {how} {value!r}", change)
