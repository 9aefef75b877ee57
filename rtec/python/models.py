"""A model in a notebook: effects with their numbers, made, read, written and asked."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec.effects import LIBRARY, Effect, Library, Units
from rtec.effects.own import as_effects
from rtec.errors import ArgumentError
from rtec.inference import model as inside
from rtec.inference.compare import check_model
from rtec.inference.fit import values_of
from rtec.inference.model_file import model_of_tables, model_tables, observe_of_tables, write_model
from rtec.python.data import Data, Source, data_of
from rtec.report.diagnosis.quantities import value_text


class Model:
    """Effects that explain a measured quantity.

    Parameters
    ----------
    effects
        Names, or effects that you wrote; or a mapping of these to their parameters, as they stand in a model file:
        ``{"cyclic": {"period": "6.35 mm", "harmonics": 2}, "backlash": {}}``. What is not given is fitted.
    observe
        What it explains.

    Raises
    ------
    ArgumentError, FileFormatError
        An effect or a parameter that there is none of.

    Examples
    --------
    >>> Model({"cyclic": {"period": "6.35 mm"}, "backlash": {"backlash": "12 um"}})
    <rtec.Model of deviation: cyclic, backlash>
    """

    def __init__(
        self,
        effects: str | Effect | Iterable[Any] | Mapping[Any, Mapping[str, object]] = (),
        *,
        observe: str = "deviation",
    ) -> None:
        given = [effects] if isinstance(effects, str | Effect) else effects
        named = given.items() if isinstance(given, Mapping) else [(one, {}) for one in given]
        own = {id(what): as_effects([what])[0] for what, _ in named if not isinstance(what, str)}
        entries = [
            {**parameters, "name": what if isinstance(what, str) else own[id(what)].name}
            for what, parameters in named
        ]
        self._set("model", {"observe": observe, "effect": entries}, LIBRARY.with_own(list(own.values())))

    def _set(self, source: str | Path, tables: dict[str, Any], library: Library) -> None:
        self.source, self.library, self._tables = source, library, tables
        self.fitted: inside.Model | None = None
        for name in self.effects:
            library.named(name)

    @classmethod
    def of(cls, model: inside.Model, library: Library = LIBRARY) -> Model:
        """Return a model that was fitted."""
        made = cls((), observe=model.observe)
        made.fitted, made.library = model, library
        return made

    @classmethod
    def read(cls, path: str | Path, effects: Iterable[object] = ()) -> Model:
        """Return the model of a TOML file; effects of your own that it names have to be given.

        Raises
        ------
        FileFormatError, ArgumentError
            A file that is no model, or names an effect that is not there.
        """
        tables, library = model_tables(path), LIBRARY.with_own(as_effects(list(effects)))
        made = cls((), observe=observe_of_tables(path, tables))
        if "observed" in tables:  # written by a program, with all units
            made.fitted, made.library = model_of_tables(path, tables, None, library), library
        else:
            made._set(path, tables, library)
        return made

    def save(self, path: str | Path) -> None:
        """Write it as a TOML file, which appears whole or not at all.

        Raises
        ------
        ArgumentError, OutputError
            It is not fitted, or the file cannot be written.
        """
        if self.fitted is None:
            allowed = "a fitted model: compare, add and diagnose return one"
            raise ArgumentError("model", "it has no numbers", allowed)
        write_model(path, self.fitted)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of its effects, each once, in order."""
        if self.fitted is not None:
            return self.fitted.names
        return tuple(dict.fromkeys(str(entry.get("name", "")) for entry in self._tables.get("effect", [])))

    @property
    def parameters(self) -> dict[str, dict[str, tuple[float | str, float | None, str]]]:
        """Value, standard error and unit of each parameter, by effect and name; nothing of what is not fitted."""
        if self.fitted is None:
            return {}
        return {
            term.name: {v.name: (v.value, v.error, v.unit) for v in values_of(term, self.fitted)}
            for term in self.fitted.terms
        }

    def predict(self, data: Data | Source) -> NDArray[np.float64]:
        """Return what it says of each reading, in the unit in which that is shown (um, arcsec, N), shape (rows,).

        Raises
        ------
        ArgumentError
            A model that is not fitted, or of something else than the data.
        """
        dataset = data_of(data).dataset(self.library)
        model = self.inside(dataset.units)
        check_model(model, dataset)
        if missing := [term.name for term in model.terms if not term.fitted]:
            allowed = "a fitted model: compare, add and diagnose return one"
            raise ArgumentError("model", f"{missing[0]} without numbers", allowed)
        found: NDArray[np.float64] = model.predict(dataset) * dataset.units.shown[1]
        return found

    def inside(self, units: Units) -> inside.Model:
        """Return it for measurements with these units inside."""
        return model_of_tables(self.source, self._tables, units, self.library) if self.fitted is None else self.fitted

    @property
    def _words(self) -> list[str]:
        return list(self.effects) if self.fitted is None else _in_words(self.fitted)

    @property
    def observe(self) -> str:
        """What it explains."""
        return observe_of_tables(self.source, self._tables)

    def __repr__(self) -> str:
        """Return its effects, with their numbers where they are fitted, in a line."""
        return f"<rtec.Model of {self.observe}: {', '.join(self._words) or 'nothing'}>"

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><td>{html.escape(words)}</td></tr>" for words in self._words)
        return f"<b>model of {html.escape(self.observe)}</b><table>{rows}</table>"


def _in_words(model: inside.Model) -> list[str]:
    found = []
    for term in model.terms:
        values = values_of(term, model)[:4] if term.fitted else ()
        numbers = ", ".join(f"{v.name} {value_text(v)}" if v.name != term.name else value_text(v) for v in values)
        found.append(f"{term.name} {numbers}".strip())
    return found
