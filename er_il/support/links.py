"""Symbolic links in folders that others made: they may lead anywhere, and copies would carry along what they find."""

import os
from pathlib import Path

from er_il.support.errors import ErIlError

TOOLS = {".git", ".cache"}  # folders of tools, which nothing here copies


def check_links(root: Path) -> None:
    """Refuse a folder with a symbolic link out of it.

    Links into the blobs of the Hub's cache, which its snapshots consist of, are none.

    Raises:
        ErIlError: there is one.
    """
    inside = [root.resolve()]
    if inside[0].parent.name == "snapshots":
        inside.append(inside[0].parents[1] / "blobs")
    for folder, folders, files in os.walk(root):
        folders[:] = [name for name in folders if name not in TOOLS]
        for name in (*folders, *files):
            path = Path(folder) / name
            if path.is_symlink() and not any(path.resolve().is_relative_to(each) for each in inside):
                raise ErIlError(
                    f"{path} is a link to {path.readlink()}, out of {root}: it is not followed. "
                    "If the file belongs there, replace the link by a copy."
                )
