"""Names of the chunk-relative spaces: ``rel_erj`` commands what ``erj`` commands, and policies see it otherwise."""

from er_il.support.errors import ErIlError

RELATIVE = "rel_"  # before the name of the space of the commands
CHUNK = 20  # actions of a chunk unless a dataset says otherwise: that of the policies which configs/ train


def commands_of(kind: str) -> str:
    """The space of the commands, ``erj``, of a space by its name, ``rel_erj`` or ``erj``."""
    return kind.removeprefix(RELATIVE)


def chunk_of(kind: str, chunk: int = CHUNK) -> int:
    """Number of actions that policies see relative to one state in a space; 0 if they see absolute ones.

    Raises:
        ErIlError: a chunk of no actions.
    """
    if chunk < 1:
        raise ErIlError(f"A chunk has at least one action, not {chunk}.")
    return chunk if kind.startswith(RELATIVE) else 0
