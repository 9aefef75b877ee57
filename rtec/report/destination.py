"""Where a report goes: a folder that the user names, or a new numbered one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rtec.errors import OutputError

_MOST_FOLDERS = 100_000


@contextmanager
def report_folder(folder: Path | None, name: str) -> Iterator[Path]:
    """Make the report's folder where it does not exist, and take it away again where writing fails.

    Parameters
    ----------
    folder
        The user's choice; None for the first of ``rtec-NAME-1``, ``-2``, ... that does not exist yet. Two runs at
        once never share one.
    name
        Of the study.

    Yields
    ------
    Path
        The folder.

    Raises
    ------
    OutputError
        It cannot be made.
    """
    made: list[Path] = []
    try:
        try:
            yield _numbered(name, made) if folder is None else _made(folder, made)
        except BaseException:
            for new in reversed(made):
                with suppress(OSError):
                    new.rmdir()  # only where it is empty
            raise
    except FileExistsError as error:
        raise OutputError(f"{error.filename}: {error.strerror}") from None


def _made(folder: Path, made: list[Path]) -> Path:
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    for place in reversed(missing):
        _make(place)
        made.append(place)
    return folder


def _numbered(name: str, made: list[Path]) -> Path:
    for number in range(1, _MOST_FOLDERS):
        folder = Path(f"rtec-{name}-{number}")
        with suppress(FileExistsError):
            _make(folder)
            made.append(folder)
            return folder
    raise OutputError(f"rtec-{name}-1 to -{_MOST_FOLDERS - 1} all exist; choose a folder with -o")


def _make(folder: Path) -> None:
    try:
        folder.mkdir()
    except FileExistsError:
        raise
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made: {error.strerror}; choose a folder with -o") from None
