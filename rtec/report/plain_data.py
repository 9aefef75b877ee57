"""Results as strict JSON holds them."""

from __future__ import annotations

import math
from typing import Any


def plain(value: object) -> Any:
    """Return a value as strict JSON holds it: what is no finite number becomes null.

    Examples
    --------
    >>> plain({"rms": float("nan"), "audit": True, "rows": (1, 2.5)})
    {'rms': None, 'audit': True, 'rows': [1, 2.5]}
    """
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "item"):  # a number of numpy
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
