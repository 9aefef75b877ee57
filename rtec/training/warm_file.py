"""The model of a row as the PC and ``rtec export`` take it."""

from __future__ import annotations

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors.warm.regressor import Regressor
from rtec.predictors.warm.warm_model import WarmModel
from rtec.training.warm_parts import WarmParts
from rtec.training.warm_results import ChannelFit


def model_of(one: ChannelFit, observe: str, parts: WarmParts) -> WarmModel:
    """Return the model of a channel, with the ranges of its inputs in training.

    Its interval is the median width over the training part and the held-out part: what the PC states is one number.

    Raises
    ------
    ArgumentError
        A row that answers only here, such as the most probable state of a network.
    """
    if not isinstance(one.regressor, Regressor):
        raise ArgumentError("--pick", "this row", "a row that can be written", "it is for comparison only")
    used = {feature.of for feature in one.features}
    ranges = {
        name: (float(values[: parts.until].min()), float(values[: parts.until].max()))
        for name, values in parts.log.inputs.items()
        if name in used
    }
    return WarmModel(
        features=one.features,
        regressor=one.regressor,
        begin=parts.begin(one.features),
        observe=observe,
        ranges=ranges,
        interval=None if one.half_um is None else float(np.median(one.half_um)),
    )
