"""Sealing: the secret beside the data file, out of sight until it is asked for.

The seal keeps a secret from a glance, not from someone who wants to read it: it is base64, with a hash of the data
file and one of the secret, so that a changed file is noticed. It is no cryptography.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
import os
from pathlib import Path
from typing import Any

from rtec.blind.game import play
from rtec.blind.hidden import Hidden, Parameter
from rtec.blind.scenario import Scenario, scenario_of
from rtec.blind.secret import Secret
from rtec.errors import ArgumentError, FileFormatError, OutputError
from rtec.metrology import write_measurement
from rtec.metrology.text_file import read_text, write_lines

SUFFIX = ".sealed"
FORMAT = "rtec blind 1"
_ALLOWED = "the file that 'rtec blind new' wrote beside the data"


def sealed_path(data: str | Path) -> Path:
    """Return where the secret of a data file is.

    Examples
    --------
    >>> sealed_path("data.csv").name
    'data.csv.sealed'
    """
    path = Path(data)
    return path.with_name(path.name + SUFFIX)


def new(seed: int, data: str | Path, *, scenario: Scenario | None = None, force: bool = False) -> Path:
    """Play a game, write its data file, and seal its secret beside it.

    Parameters
    ----------
    seed
        Decides what is hidden, and everything else.
    data
        The measurement file (CSV) to be written.
    scenario
        What to hide; None lets the seed decide.
    force
        Replace files that exist.

    Returns
    -------
    Path
        The sealed file.

    Raises
    ------
    ArgumentError
        A seed outside its range, or a data file that is no regular file.
    OutputError
        A file exists and is not to be replaced, or cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "data.csv"
    >>> new(3, file).name, reveal(file).seed
    ('data.csv.sealed', 3)
    """
    path, seal = Path(data), sealed_path(data)
    for place in (path, seal):
        if place.exists() and not place.is_file():
            raise ArgumentError("data", place, "a regular file", "a seal belongs to a file that stays")
        if os.path.lexists(place) and not force:
            raise OutputError(f"{place}: exists; choose another name, or overwrite it with --force")
    measurement, secret = play(scenario_of(seed) if scenario is None else scenario, seed)
    write_measurement(path, measurement)
    write_lines(seal, [json.dumps(_sealed(path, secret), indent=1)])
    return seal


def reveal(data: str | Path) -> Secret:
    """Open the secret of a data file.

    Parameters
    ----------
    data
        The measurement file, with the sealed file beside it.

    Raises
    ------
    FileFormatError
        A file is missing, the sealed file is no such file, or the data file is not the one that was sealed.
    """
    path, seal = Path(data), sealed_path(data)
    read_text(path)
    document = _parsed(seal, read_text(seal))
    if document.get("format") != FORMAT:
        raise FileFormatError(seal, None, f"this is no secret of the game ({FORMAT})", _ALLOWED)
    if document.get("data_sha256") != _sha256(path.read_bytes()):
        problem = f"it does not belong to {path}: that file is not the one that was sealed"
        raise FileFormatError(seal, None, problem, "the data file as it was written")
    try:
        text = base64.b64decode(document["secret"], validate=True)
    except (KeyError, TypeError, ValueError, binascii.Error):
        raise FileFormatError(seal, None, "its secret cannot be read", _ALLOWED) from None
    if document.get("secret_sha256") != _sha256(text):
        raise FileFormatError(seal, None, "its secret was changed", _ALLOWED)
    try:
        return secret_from(json.loads(text))
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError):
        raise FileFormatError(seal, None, "its secret cannot be read", _ALLOWED) from None


def _sealed(data: Path, secret: Secret) -> dict[str, str]:
    """Return the content of the sealed file."""
    text = json.dumps(document_of(secret), allow_nan=False).encode()
    return {
        "format": FORMAT,
        "about": "what is hidden in the data file; 'rtec blind reveal' opens it",
        "data_sha256": _sha256(data.read_bytes()),
        "secret_sha256": _sha256(text),
        "secret": base64.b64encode(text).decode("ascii"),
    }


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _parsed(path: Path, text: str) -> dict[str, Any]:
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        raise FileFormatError(path, None, "this is no JSON", _ALLOWED) from None
    if not isinstance(document, dict):
        raise FileFormatError(path, None, "this is no JSON object", _ALLOWED)
    return document


def document_of(secret: Secret) -> dict[str, Any]:
    """Return a secret as a JSON document.

    Examples
    --------
    >>> document_of(Secret(effects=(), noise="white", sigma_um=2.0, seed=1, plan="base", outside=()))["effects"]
    []
    """
    return {
        "seed": secret.seed,
        "plan": secret.plan,
        "noise": secret.noise,
        "sigma_um": secret.sigma_um,
        "outside": list(secret.outside),
        "effects": [
            {
                "name": hidden.name,
                "description": hidden.description,
                "rms_sigma": hidden.rms_sigma,
                "rms_um": hidden.rms_sigma * secret.sigma_um,
                "parameters": [{"name": p.name, "value": p.value, "unit": p.unit} for p in hidden.parameters],
            }
            for hidden in secret.effects
        ],
    }


def secret_from(document: dict[str, Any]) -> Secret:
    """Return the secret that a JSON document holds.

    Raises
    ------
    KeyError, TypeError, ValueError
        It holds none.
    """
    return Secret(
        effects=tuple(
            Hidden(
                name=str(one["name"]),
                description=str(one["description"]),
                parameters=tuple(
                    Parameter(str(p["name"]), float(p["value"]), str(p["unit"])) for p in one["parameters"]
                ),
                rms_sigma=float(one["rms_sigma"]),
            )
            for one in document["effects"]
        ),
        noise=str(document["noise"]),
        sigma_um=float(document["sigma_um"]),
        seed=int(document["seed"]),
        plan=str(document["plan"]),
        outside=tuple(str(name) for name in document["outside"]),
    )
