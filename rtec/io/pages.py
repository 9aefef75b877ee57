"""The pages of the documentation, where they are installed with the package."""

from __future__ import annotations

from pathlib import Path


def pages_folder() -> Path:
    """Return the folder of the pages: ``rtec/docs`` where they are installed, ``docs`` of a checkout.

    Examples
    --------
    >>> (pages_folder() / "effects.md").is_file()
    True
    """
    installed = Path(__file__).parents[1] / "docs"
    return installed if installed.is_dir() else Path(__file__).parents[2] / "docs"
