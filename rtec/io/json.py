"""JSON as its standard has it: no NaN, no infinity, every key of an object once."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any


def strict(value: object) -> Any:
    """Return a value as strict JSON holds it: what is no finite number becomes null, a number of numpy a plain one.

    Examples
    --------
    >>> strict({"rms": float("nan"), "audit": True, "rows": (1, 2.5)})
    {'rms': None, 'audit': True, 'rows': [1, 2.5]}
    """
    if isinstance(value, Mapping):
        return {str(key): strict(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [strict(item) for item in value]
    if hasattr(value, "item"):  # a number of numpy
        return strict(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def json_text(document: object, *, indent: int | None = None, ascii_only: bool = True) -> str:
    r"""Return a document as one text of strict JSON, without a line end.

    ``indent`` is that of each level, None for a single line; with ``ascii_only`` all other characters are spelled out
    as ``\u00b5``.

    Examples
    --------
    >>> json_text({"A": 1.5, "B": float("nan"), "rows": (1, float("inf"))})
    '{"A": 1.5, "B": null, "rows": [1, null]}'
    """
    return json.dumps(strict(document), indent=indent, allow_nan=False, ensure_ascii=ascii_only)


def parse_json(text: str | bytes) -> Any:
    """Return what a text of strict JSON holds.

    Raises
    ------
    ValueError
        No JSON, no UTF-8, nested too deeply, NaN or an infinity, or a key that stands twice in an object.

    Examples
    --------
    >>> parse_json('{"a": 1, "a": 2}')
    Traceback (most recent call last):
        ...
    ValueError: the key 'a' stands twice
    """
    try:
        return json.loads(text, object_pairs_hook=_object, parse_constant=_no_number)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"the key {key[:40]!r} stands twice")
        found[key] = value
    return found


def _no_number(word: str) -> None:
    raise ValueError(f"{word} is no number of JSON")
