"""Methods that predict a warm machine, each a row of the table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from rtec.predictors.warm.fuzzy import Conjunction
from rtec.training.warm_effects import fit_effects
from rtec.training.warm_linear import fit_lags, fit_mean, fit_plain, fit_plain_ridge
from rtec.training.warm_nonlinear import fit_bayesian, fit_bayesian_mode, fit_both, fit_machine, fit_network
from rtec.training.warm_results import WarmKind
from rtec.training.warm_task import WarmFit, WarmTask


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmMethod:
    """One row of the table.

    Parameters
    ----------
    name, kind
        What it is.
    fit
        Fits it to every channel.
    needs_blocks
        Whether it has no figure where a single block trains.
    """

    name: str
    kind: WarmKind
    fit: Callable[[WarmTask], WarmFit]
    needs_blocks: bool = True


def warm_methods() -> tuple[WarmMethod, ...]:
    """Return the methods, the plain ones first; some take features that those before them chose."""
    none, linear, physical, bayes = WarmKind.NONE, WarmKind.LINEAR, WarmKind.PHYSICAL, WarmKind.BAYES
    product, minimum = (partial(fit_network, conjunction=one) for one in (Conjunction.PRODUCT, Conjunction.MINIMUM))
    return (
        WarmMethod(name="mean", kind=none, fit=fit_mean, needs_blocks=False),
        WarmMethod(name="least squares", kind=linear, fit=fit_plain),
        WarmMethod(name="ridge", kind=linear, fit=fit_plain_ridge),
        WarmMethod(name="first-order lags", kind=physical, fit=fit_lags),
        WarmMethod(name="LS-SVM", kind=WarmKind.KERNEL, fit=fit_machine),
        WarmMethod(name="fuzzy network product", kind=WarmKind.FUZZY, fit=product),
        WarmMethod(name="fuzzy network minimum", kind=WarmKind.FUZZY, fit=minimum),
        WarmMethod(name="Bayesian network", kind=bayes, fit=fit_bayesian),
        WarmMethod(name="Bayesian network mode", kind=bayes, fit=fit_bayesian_mode),
        WarmMethod(name="Bayesian network with LS-SVM", kind=bayes, fit=fit_both),
        WarmMethod(name="named effects", kind=physical, fit=fit_effects),
    )
