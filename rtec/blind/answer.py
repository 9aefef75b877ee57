"""What a judge answers, and when an answer is right."""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

from rtec.blind.hidden import Secret
from rtec.effects.frequency_grid import FEWEST_CYCLES
from rtec.inference.fit import values_of
from rtec.inference.results import Diagnosis, Value
from rtec.metrology import Measurement


class Answer(NamedTuple):
    """What a judge says of a measurement."""

    verdict: str
    """As in `rtec.inference.results.Verdict`."""
    effects: tuple[str, ...] = ()
    """Accepted."""
    tied: tuple[str, ...] = ()
    """That explain the data equally; none where the judge does not tell."""
    experiment: str = ""
    """That would separate them; empty where the judge does not tell."""
    detectable_um: Mapping[str, float] = MappingProxyType({})
    """RMS contribution of each effect that the judge says it would find."""
    accepted: tuple[str, ...] = ()
    """Of the candidates; under TIED the judge puts them forward, whatever it counts as effects."""
    values: tuple[tuple[str, tuple[Value, ...]], ...] = ()
    """Numbers of each effect of the model that was found, as people read them."""
    probability: Mapping[str, float] = MappingProxyType({})
    """Of each accepted effect; empty where the judge gives none."""


Judge = Callable[[Measurement], "Answer | tuple[str, tuple[str, ...]]"]
"""Looks at a measurement and answers; a pair of verdict and effects will do."""


def answer_of(diagnosis: Diagnosis) -> Answer:
    """Return the answer that a diagnosis gives."""
    unit, factor = diagnosis.dataset.units.shown
    to_um = factor if unit == "um" else 1.0
    tied = dict.fromkeys(
        name for one in diagnosis.candidates if one.tied_with for name in (one.effect, *one.tied_with)
    )
    return Answer(
        verdict=diagnosis.verdict.value,
        effects=diagnosis.effects,
        tied=tuple(tied),
        experiment=diagnosis.experiment.text,
        detectable_um={name: value * to_um for name, value in diagnosis.minimum_detectable},
        accepted=tuple(dict.fromkeys(one.effect for one in diagnosis.candidates if one.accepted)),
        values=tuple((term.name, values_of(term, diagnosis.model)) for term in diagnosis.model.terms),
        probability=dict(getattr(diagnosis, "probability", {})),
    )


class Rule(enum.Enum):
    """What makes an answer right."""

    NOTHING = "nothing is named"
    NAMED = "what was hidden is named, and nothing else"
    UNKNOWN = "the verdict is UNKNOWN"
    TIED = "the verdict is TIED, and the right experiment is suggested"
    WRONG_NAME = "no effect is named that is not there"
    FLOOR = "held-out error within 10 % of the noise floor"


EXPERIMENTS: Mapping[frozenset[str], tuple[str, ...]] = MappingProxyType(
    {
        frozenset(("scale", "drift")): ("datum", "interleave"),
        frozenset(("backlash", "servo_lag")): ("feeds",),
        frozenset(("backlash", "lost_counts")): ("index", "cycle"),
        frozenset(("pitch_map", "thermal_growth")): ("cold",),
        frozenset(("drift", "thermal_shift")): ("cool",),
        frozenset(("drift", "refraction")): ("pressure",),
        frozenset(("viscous", "force_offset")): ("speeds",),
        frozenset(("scale", "thermal_shift")): ("cold",),
    }
)
"""Words of which the experiment that separates a pair has one."""


WAVES = ("cyclic", "cogging")
"""Effects whose period is found; that of the scale's signal is stated in the file."""
NAMES = ("NAMED", "LIKELY", "TIED")
"""Verdicts that put names forward."""
_NO_NAME = "offset"
"""What any record may have, and no effect."""
NAMES_OF_NOISE: Mapping[str, frozenset[str]] = MappingProxyType({"offsets per run": frozenset(("run_offset",))})
"""Effects that a family of noise is: to name them there is right."""


def named(answer: Answer) -> frozenset[str]:
    """Return the effects that an answer puts forward.

    Those accepted under NAMED, LIKELY and TIED, where candidates that were accepted count as well; where a tie has
    accepted none, all that are tied.

    Examples
    --------
    >>> sorted(named(Answer("LIKELY", ("drift", "offset")))), named(Answer("UNKNOWN", ("drift",)))
    (['drift'], frozenset())
    """
    if answer.verdict not in NAMES:
        return frozenset()
    names = {*answer.effects, *(answer.accepted if answer.verdict == "TIED" else ())}
    return frozenset(names or answer.tied if answer.verdict == "TIED" else names) - {_NO_NAME}


def is_right(rule: Rule, answer: Answer, secret: Secret, *, repeated: bool = True, span_mm: float = 0.0) -> bool:
    """Return whether an answer is right.

    Parameters
    ----------
    rule
        What makes it right; not `Rule.FLOOR`, which asks for no answer.
    answer
        What the judge said.
    secret
        What was hidden.
    repeated
        Whether the plan repeats its readings; where it does not, or where the noise is not white, so that repeats say
        little of a floor, LIKELY is as good as NAMED.
    span_mm
        Of the plan: a wave of fewer than five cycles over it is right as UNKNOWN or INCONCLUSIVE, too.

    Examples
    --------
    >>> nothing = Secret(effects=(), noise="white", sigma_um=2.0, seed=1, plan="base", outside=())
    >>> is_right(Rule.NOTHING, Answer("NONE"), nothing), is_right(Rule.NOTHING, Answer("NAMED", ("drift",)), nothing)
    (True, False)
    """
    if rule is Rule.NOTHING:
        return not answer.effects and answer.verdict not in NAMES
    if rule is Rule.NAMED:
        said = ("NAMED",) if repeated and secret.noise == "white" else ("NAMED", "LIKELY")
        modest = answer.verdict in ("UNKNOWN", "INCONCLUSIVE") and _too_long(secret, span_mm)
        return modest or (answer.verdict in said and set(answer.effects) == set(secret.names))
    if rule is Rule.WRONG_NAME:
        return not wrong_names(answer, secret)
    return answer.verdict == "UNKNOWN" if rule is Rule.UNKNOWN else _is_tied(answer, secret)


def _is_tied(answer: Answer, secret: Secret) -> bool:
    """Return whether an answer puts what was hidden beside what it is confounded with, and asks to separate them."""
    if answer.verdict != "TIED" or (answer.tied and not set(secret.names) <= set(answer.tied)):
        return False
    words = [word for pair in _pairs_of(secret) for word in EXPERIMENTS[pair]]
    return not answer.experiment or any(word in answer.experiment.lower() for word in words)


def _too_long(secret: Secret, span_mm: float) -> bool:
    """Return whether a wave of an unstated period with fewer than five cycles in the span was hidden."""
    periods = [p.value for e in secret.effects if e.name in WAVES for p in e.parameters if p.name == "period"]
    return any(FEWEST_CYCLES * period > span_mm for period in periods) and span_mm > 0.0


def wrong_names(answer: Answer, secret: Secret) -> frozenset[str]:
    """Return the effects that an answer puts forward and that are not there.

    Examples
    --------
    >>> bare = Secret(effects=(), noise="offsets per run", sigma_um=2.0, seed=1, plan="base", outside=())
    >>> wrong_names(Answer("NAMED", ("offset", "run_offset", "drift")), bare)
    frozenset({'drift'})
    """
    return named(answer) - set(secret.names) - NAMES_OF_NOISE.get(secret.noise, frozenset())


def _pairs_of(secret: Secret) -> Iterator[frozenset[str]]:
    return (pair for pair in EXPERIMENTS if pair & set(secret.names))


def label_of(answer: Answer) -> str:
    """Return an answer as a heading of the confusion matrix.

    Examples
    --------
    >>> label_of(Answer("NAMED", ("scale", "drift"))), label_of(Answer("UNKNOWN", ("scale",)))
    ('drift + scale', 'UNKNOWN')
    """
    return truth_label(answer.effects) if answer.verdict in ("NAMED", "LIKELY") else answer.verdict


def truth_label(names: tuple[str, ...]) -> str:
    """Return what was hidden as a heading of the confusion matrix."""
    return " + ".join(sorted(names)) or "nothing"
