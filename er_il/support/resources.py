"""Locations of recipes, configurations and cards: in the checkout, or packed into the wheel."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


def data_dir(kind: str) -> Path:
    """Folder of shipped files, such as ``datasets`` or ``configs``.

    The checkout's own folder if er_il runs from one, else the copy inside the installed package.
    """
    checkout = _PACKAGE.parent
    # In site-packages, a neighbour called "datasets" is Hugging Face's library: only a project file tells a checkout.
    return checkout / kind if (checkout / "pyproject.toml").is_file() else _PACKAGE / "_data" / kind
