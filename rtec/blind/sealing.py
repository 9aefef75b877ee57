"""Sealing: the secret beside the data file, out of sight until it is asked for.

The seal keeps a secret from a glance, not from someone who wants to read it: it is base64, with a hash of the data
file and one of the secret, so that a changed file is noticed. It is no cryptography.
"""

from __future__ import annotations

import base64
import binascii
import contextlib
import hashlib
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rtec.blind.game import again, play
from rtec.blind.hidden import Hidden, Parameter, Secret
from rtec.blind.scenario import Scenario, scenario_document, scenario_from, scenario_of
from rtec.checks import whole_within
from rtec.effects.protocol import Effect
from rtec.errors import ArgumentError, FileFormatError, OutputError, RtecError
from rtec.io import json_text, parse_json, read_bytes, read_text, write_text
from rtec.metrology import Measurement, read_experiment, write_measurement
from rtec.metrology.experiment_file import naming_keys

SUFFIX = ".sealed"
FORMAT = "rtec blind 3"
_SAME = 1e-6
"""Share by which numbers of one effect may differ: two processors round differently."""
_OTHER = "an effect of --effects is not the one that was hidden: give its file as it was"
_ALLOWED = "the file that 'rtec blind new' wrote beside the data"


@dataclass(frozen=True, slots=True, kw_only=True)
class Sealed:
    """What a seal keeps."""

    secret: Secret
    """What is hidden in the data file."""
    scenario: Scenario
    """What was hidden in the axis when it was first measured; with the seed of the secret, the axis itself."""
    number: int
    """Of the measurement: 0 for the first."""


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
    with _reserved(data, force=force):
        hidden = scenario_of(seed) if scenario is None else scenario
        measurement, secret = play(hidden, seed)
        return _write(data, measurement, Sealed(secret=secret, scenario=hidden, number=0))


def measure(
    data: str | Path,
    plan: str | Path,
    output: str | Path,
    *,
    seed: int | None = None,
    own: Sequence[Effect] = (),
    force: bool = False,
) -> Path:
    """Carry an experiment out on the axis of a data file, write what was measured, and seal its secret beside it.

    Parameters
    ----------
    data
        A measurement of the axis, with the sealed file beside it.
    plan
        The experiment (TOML).
    output
        The measurement file (CSV) to be written.
    seed
        Of the noise, the targets and the surroundings; None takes the next one after that of ``data``.
    own
        The player's own effects that the game hides.
    force
        Replace files that exist.

    Returns
    -------
    Path
        The sealed file.

    Raises
    ------
    ArgumentError
        A plan that the axis cannot carry out, or an output that is the data file.
    RtecError
        An own effect that the game hides is not given, or another one of that name.
    FileFormatError
        A file is missing or is not what it should be.
    OutputError
        A file exists and is not to be replaced, or cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from rtec.metrology import ExperimentPlan, write_experiment
    >>> folder = Path(tempfile.mkdtemp())
    >>> _ = new(3, folder / "data.csv", scenario=Scenario(names=("backlash",)))
    >>> write_experiment(folder / "plan.toml", ExperimentPlan(runs=3, targets=11))
    >>> measure(folder / "data.csv", folder / "plan.toml", folder / "second.csv").name
    'second.csv.sealed'
    >>> reveal(folder / "second.csv").names == reveal(folder / "data.csv").names
    True
    """
    sealed = opened(data, own)
    experiment = read_experiment(plan)
    for needed in (Path(data), sealed_path(data), Path(plan)):
        for new_file in (Path(output), sealed_path(output)):
            if new_file.exists() and new_file.samefile(needed):
                allowed = "another file than the data, its seal and the plan"
                raise ArgumentError("output", output, allowed, f"{needed} is still needed")
    with _reserved(output, force=force):
        number = sealed.number + 1 if seed is None else seed
        with naming_keys(plan):
            measurement, secret = again(sealed.scenario, sealed.secret.seed, experiment, number)
        if _differs(sealed, secret):
            raise RtecError(f"{data}: {_OTHER}")
        return _write(output, measurement, Sealed(secret=secret, scenario=sealed.scenario, number=number))


@contextlib.contextmanager
def _reserved(data: str | Path, *, force: bool) -> Iterator[None]:
    """Refuse to write over files; keep the name of the seal meanwhile, so that no other game takes it as well."""
    seal = sealed_path(data)
    for place in (Path(data), seal):
        if place.exists() and not place.is_file():
            raise ArgumentError("data", place, "a regular file", "a seal belongs to a file that stays")
        if os.path.lexists(place) and not force:
            raise _existing(place)
    if force:
        yield
        return
    try:
        seal.touch(exist_ok=False)
    except FileExistsError:
        raise _existing(seal) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise OutputError(f"{seal}: cannot be written: {reason}; choose another folder") from None
    try:
        yield
    except BaseException:
        seal.unlink(missing_ok=True)
        raise


def _existing(place: Path) -> OutputError:
    return OutputError(f"{place}: exists; choose another name, or overwrite it with --force")


def _write(data: str | Path, measurement: Measurement, sealed: Sealed) -> Path:
    path, seal = Path(data), sealed_path(data)
    write_measurement(path, measurement)
    write_text(seal, json_text(_document(path, sealed), indent=1) + "\n")
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
    with _readable(data) as document:
        return secret_from(document)


def opened(data: str | Path, own: Sequence[Effect] = ()) -> Sealed:
    """Open what is sealed beside a data file: the secret, and the axis itself, to be measured again.

    ``own`` has the effects of a player's own that the axis hides.

    Raises
    ------
    FileFormatError
        As in `reveal`.
    RtecError
        An own effect that the axis hides is not given.
    """
    with _readable(data) as document:
        axis = document["axis"]
        hidden = axis["scenario"].get("own", ())
        given = [effect for effect in own if effect.name in hidden]
        if len(given) < len(hidden):
            raise RtecError(f"{data}: this game hides an effect of somebody's own: give its file with --effects")
        try:
            scenario = scenario_from(axis["scenario"], given)
        except ArgumentError:
            if given:
                raise RtecError(f"{data}: {_OTHER}") from None
            raise
        number = whole_within("number", axis["number"], 0, 1 << 62)
        return Sealed(secret=secret_from(document), scenario=scenario, number=number)


def _differs(sealed: Sealed, secret: Secret) -> bool:
    """Return whether an own effect has other numbers than those that were sealed."""
    for before, now in zip(sealed.secret.effects, secret.effects, strict=True):
        if now.name in sealed.scenario.own_names:
            names = [[one.name for one in hidden.parameters] for hidden in (before, now)]
            pairs = zip(before.parameters, now.parameters, strict=False)
            if names[0] != names[1] or not all(math.isclose(a.value, b.value, rel_tol=_SAME) for a, b in pairs):
                return True
    return False


@contextlib.contextmanager
def _readable(data: str | Path) -> Iterator[dict[str, Any]]:
    """Yield the secret of a data file as its document; what it lacks is one clear error."""
    path, seal = Path(data), sealed_path(data)
    content = read_bytes(path)
    if not seal.exists():
        allowed = f"{seal.name} beside {path.name}, as 'rtec blind new' wrote the two: they go together"
        raise FileFormatError(seal, None, "there is no such file", allowed)
    document = _parsed(seal, read_text(seal))
    if document.get("format") != FORMAT:
        raise FileFormatError(seal, None, f"this is no secret of the game ({FORMAT})", _ALLOWED)
    if document.get("data_sha256") != _sha256(content):
        problem = f"it does not belong to {path}: that file is not the one that was sealed"
        raise FileFormatError(seal, None, problem, "the data file as it was written")
    try:
        text = base64.b64decode(document["secret"], validate=True)
    except (KeyError, TypeError, ValueError, binascii.Error):
        raise FileFormatError(seal, None, "its secret cannot be read", _ALLOWED) from None
    if document.get("secret_sha256") != _sha256(text):
        raise FileFormatError(seal, None, "its secret was changed", _ALLOWED)
    try:
        yield parse_json(text)
    except (AttributeError, KeyError, TypeError, ValueError):
        raise FileFormatError(seal, None, "its secret cannot be read", _ALLOWED) from None


def _document(data: Path, sealed: Sealed) -> dict[str, str]:
    axis = {"scenario": scenario_document(sealed.scenario), "number": sealed.number}
    text = json_text({**document_of(sealed.secret), "axis": axis}).encode()
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
        document = parse_json(text)
    except ValueError:
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
