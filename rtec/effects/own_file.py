"""Effects of a Python file that the user named, and of no other."""

from __future__ import annotations

import contextlib
import importlib.machinery
import importlib.util
import sys
import traceback
from pathlib import Path

from rtec.effects.library import LIBRARY, Library
from rtec.effects.own import as_effects
from rtec.effects.protocol import Effect
from rtec.errors import ArgumentError


class _Loader(importlib.machinery.SourceFileLoader):
    def set_data(self, path: str, data: object, *, _mode: int = 0o666) -> None:
        """Leave no machine code of Python's beside the user's file."""


def library_of_file(path: Path | None, *, name: str = "--effects") -> Library:
    r"""Return the library with the effects of a Python file, which is run; without a file as it comes.

    An effect is whatever ``@rtec.effect`` made or a class derived from `Effect` that the file itself defines. What
    the file prints goes to stderr.

    Raises
    ------
    ArgumentError
        No Python file, one that fails, with its line, or one without effects.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "mine.py"
    >>> _ = file.write_text("import rtec\n@rtec.effect\ndef lean(position):\n    return position ** 2\n")
    >>> [effect.name for effect in library_of_file(file).own]
    ['lean']
    """
    if path is None:
        return LIBRARY
    if path.suffix != ".py" or not path.is_file():
        problem = "is no file" if not path.is_file() else "is no Python file"
        raise ArgumentError(name, path, "a file NAME.py with your effects", problem=problem)
    module_name = f"rtec_effects_of_{path.stem}"
    spec = importlib.util.spec_from_file_location(module_name, path, loader=_Loader(module_name, str(path)))
    if spec is None or spec.loader is None:
        raise ArgumentError(name, path, "a file NAME.py with your effects", problem="cannot be read")
    module = importlib.util.module_from_spec(spec)
    try:
        with contextlib.redirect_stdout(sys.stderr):
            spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        where, problem = _told(error, path)
        raise ArgumentError(name, where, "a file that runs by itself", problem=f"fails: {problem}") from error
    found = [
        one
        for one in vars(module).values()
        if isinstance(one, Effect)
        or (isinstance(one, type) and issubclass(one, Effect) and one.__module__ == module.__name__)
    ]
    if not found:
        raise ArgumentError(name, path, "@rtec.effect above a function of quantities", problem="has no effect in it")
    return LIBRARY.with_own(as_effects(found))


def _told(error: BaseException, path: Path) -> tuple[str, str]:
    """Return in which line of a file something went wrong, and what."""
    if isinstance(error, SyntaxError):
        line, said = error.lineno, error.msg
    else:
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
        line, said = (lines[-1] if lines else None), f"{error}"
    where = path.name if line is None else f"{path.name}, line {line}"
    return where, f"{type(error).__name__}: {said}"[:300]
