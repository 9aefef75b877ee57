"""Files that get to their places together, or not at all."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rtec.errors import OutputError


@contextmanager
def whole_folder(folder: Path, *, last: str = "") -> Iterator[Path]:
    r"""Let files be made in a hidden folder inside ``folder``, and move them to their places at the end.

    An error, a full disk or Ctrl-C leaves the folder as it was. What stands in the way under the same name is
    replaced. The ``last`` file, such as a page, comes when the others it shows are there.

    Raises
    ------
    OutputError
        The folder is missing or not writable, or the disk is full.

    Examples
    --------
    >>> place = Path(tempfile.mkdtemp())
    >>> with whole_folder(place) as new:
    ...     _ = (new / "rows.csv").write_text("name,rms\n")
    ...     (place / "rows.csv").exists()
    False
    >>> [path.name for path in place.iterdir()]
    ['rows.csv']
    """
    part: Path | None = None
    try:
        part = Path(tempfile.mkdtemp(prefix=".rtec-report-", dir=folder))
        new = part / "new"
        new.mkdir()
        yield new
        _move_into_place(new, part / "old", folder, last)
    except OSError as error:
        raise OutputError(f"{folder}: the report cannot be written ({_reason(error, part)}); nothing was") from None
    finally:
        if part is not None:
            shutil.rmtree(part, ignore_errors=True)


def _reason(error: OSError, part: Path | None) -> str:
    """Return why, without the name of the hidden folder."""
    text = error.strerror or str(error)
    return text.replace(f"{part}{os.sep}new{os.sep}", "") if part is not None else text


def _move_into_place(new: Path, old: Path, folder: Path, last: str) -> None:
    """Move the entries of ``new`` into ``folder``, those in the way into ``old``; undo that where it fails."""
    old.mkdir()
    done: list[tuple[Path, Path]] = []
    try:
        for entry in sorted(new.iterdir(), key=lambda path: (path.name == last, path.name)):
            place = folder / entry.name
            moves = [(place, old / entry.name)] if os.path.lexists(place) else []
            for source, target in [*moves, (entry, place)]:
                # noted before it is done: an interruption in between is undone as well
                done.append((source, target))
                source.rename(target)
    except BaseException:
        for source, target in reversed(done):
            if not os.path.lexists(source):
                with contextlib.suppress(OSError):
                    target.rename(source)
        raise
