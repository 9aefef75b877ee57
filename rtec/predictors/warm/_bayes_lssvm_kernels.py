"""Compiled Bayesian network with LS-SVMs: the network weighs conditions, and the machine of each answers.

Numbers: signs, conditions, machines, places of the classifier and of each machine; for each sign the column and the
one that is taken off (-1: none); for each condition its machine; the classifier (`_bayes_kernels`, a regressor whose
columns are the signs); the machines (`_lssvm_kernels`).

The room begins with the signs, then the answer and the standard deviation of each machine; the rest is scratch.
"""

from __future__ import annotations

import math

from rtec._jit import kernel
from rtec.predictors._columns import Floats
from rtec.predictors.warm._bayes_kernels import eliminate, observe
from rtec.predictors.warm._lssvm_kernels import ls_svm_answer

PLACES = 3
"""Where the places of the classifier and of the machines begin."""


@kernel
def bayes_ls_svm_answer(numbers: Floats, columns: Floats, room: Floats, sd: Floats) -> float:
    """Return the mean over all conditions for one row of columns, and write its standard deviation."""
    signs, conditions, machines = int(numbers[0]), int(numbers[1]), int(numbers[2])
    p = PLACES + 1 + machines
    for k in range(signs):
        beside = int(numbers[p + 1])
        room[k] = columns[int(numbers[p])] - (columns[beside] if beside >= 0 else 0.0)
        p += 2
    scratch = room[signs + 2 * machines :]
    for m in range(machines):
        place = signs + 2 * m
        room[place] = ls_svm_answer(numbers[int(numbers[PLACES + 1 + m]) :], columns, scratch, room[place + 1 :])
    classifier = numbers[int(numbers[PLACES]) :]
    observe(classifier, room, scratch)
    result = eliminate(classifier, int(classifier[2]), scratch)
    total = mean = 0.0
    for c in range(conditions):
        total += scratch[result + c]
        mean += scratch[result + c] * room[signs + 2 * int(numbers[p + c])]
    mean /= total
    variance = 0.0
    for c in range(conditions):
        place = signs + 2 * int(numbers[p + c])
        beside = room[place] - mean
        variance += scratch[result + c] / total * (room[place + 1] * room[place + 1] + beside * beside)
    sd[0] = math.sqrt(variance)
    return mean
