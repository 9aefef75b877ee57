"""A built-in design searched through, with what is found played again and judged."""

from __future__ import annotations

import time
from collections.abc import Callable

from rtec.errors import RtecError
from rtec.injector import Algorithm
from rtec.verify.contract._python_child import load
from rtec.verify.contract.built_in import BuiltIn
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.exhaustive.box_search import BoxSearch, Grid
from rtec.verify.contract.exhaustive.class_search import ClassSearch
from rtec.verify.contract.exhaustive.result import Ending, Exhausted
from rtec.verify.contract.python_class import PythonClass
from rtec.verify.contract.trials import Trials

MOST_STATES, MOST_S = 20_000_000, 600.0
_FINER = (1, 2, 4, 10, 20)


def prove(
    algorithm: Algorithm,
    contract: Contract,
    *,
    finer: int = 1,
    most_states: int = MOST_STATES,
    most_s: float = MOST_S,
    progress: Callable[[int], None] = lambda found: None,
) -> Exhausted:
    """Search all reachable states of encoder, box and decoder for one that breaks the contract.

    Parameters
    ----------
    algorithm
        A design of rtec, or a Python class that declares its state (docs/algorithm.md).
    contract
        What is asked of it, and what the axis does.
    finer
        How much finer than the coarsest grid that divides all times of the box the first one is.
    most_states, most_s
        Where the search gives up.
    progress
        Called now and then with the number of states found.

    Returns
    -------
    Exhausted
        Proved; or broken, with the run that shows it; or not decided, and why.

    Raises
    ------
    RtecError
        The state of the algorithm is not known to be finite.

    Notes
    -----
    Times of the axis are rounded to the grid to its favour (docs/exhaustive.md), so that a way to a wrong state may
    be one that no axis goes: then the next finer grid is searched.

    Examples
    --------
    Without the latch that holds real edges back, an edge comes too close to a change of the insertion:

    >>> from rtec.injector import Design, InjectorSettings, Processor, Timing
    >>> box = BuiltIn(InjectorSettings(design=Design.C, timing=Timing.of(Design.C, Processor.FAST)))
    >>> found = prove(box, Contract.of(Design.C))
    >>> found.ending.value, found.worst.fault.value
    ('broken', 'separation')
    """
    if isinstance(algorithm, PythonClass):
        return _prove_class(algorithm, contract, most_s, progress)
    if not isinstance(algorithm, BuiltIn):
        allowed = "takes a design of rtec or a Python class that declares its state"
        raise RtecError(f"{algorithm.name}: --exhaustive {allowed}")
    settings = algorithm.settings
    begun = time.monotonic()
    coarsest = Grid.of(settings, contract).grid_ps
    grids = [k for k in _FINER if k >= finer and coarsest % k == 0]
    for k in grids:
        search = BoxSearch(settings, contract, finer=k)
        left_s = begun + most_s - time.monotonic()
        ending = search.run(most_states=most_states, most_s=left_s, progress=progress)
        worst, note = None, ""
        if ending is Ending.BROKEN:
            trials = Trials(algorithm, contract)
            rest_ps = settings.timing.rest_ps
            worst = search.way().played(trials, 10 * (rest_ps + search.grid.quiet * search.grid.grid_ps))
            if worst is None and k != grids[-1] and time.monotonic() < begun + most_s:
                continue
            if worst is None:
                ending, note = Ending.UNDECIDED, "what the model breaks no run shows, on the finest grid tried"
        elif ending is Ending.UNDECIDED:
            note = "too many states" if search.waiting else "it does not come to rest from each state"
        break
    return Exhausted(
        algorithm=algorithm.name,
        contract=contract,
        ending=ending,
        states=search.found,
        waiting=search.waiting,
        successors=search.made,
        grid_ps=search.grid.grid_ps,
        window=None,
        seconds=time.monotonic() - begun,
        delay_ps=search.delay_ps,
        worst=worst,
        note=note,
    )


def _prove_class(
    algorithm: PythonClass, contract: Contract, most_s: float, progress: Callable[[int], None]
) -> Exhausted:
    """Search the states of a user's class, in this process; what is found is played in its own."""
    begun = time.monotonic()
    try:
        kind = load(algorithm.file, algorithm.class_name)
    except ImportError as error:
        raise RtecError(f"{algorithm.name}: {error}") from None
    if algorithm.clock_ps[0]:
        raise RtecError(f"{algorithm.name}: --exhaustive takes no --clock")
    for together in (True, False):
        search = ClassSearch(kind, contract, together=together)
        ending = search.run(most_s=begun + most_s * (0.3 if together else 1.0) - time.monotonic(), progress=progress)
        worst, note = None, ""
        if ending is Ending.BROKEN:
            way = search.way()
            worst = way.played(Trials(algorithm, contract), 2 * contract.delay_ps + 100 * search.forgets_ps)
        if worst is not None:
            break
    if ending is Ending.BROKEN and worst is None:
        ending, note = Ending.UNDECIDED, "what the model breaks no run shows"
    elif ending is Ending.UNDECIDED:
        note = f"too many states{search.hint()}"
    return Exhausted(
        algorithm=algorithm.name,
        contract=contract,
        ending=ending,
        states=search.found,
        waiting=search.waiting,
        successors=search.made,
        grid_ps=search.grid_ps,
        window=search.window,
        seconds=time.monotonic() - begun,
        delay_ps=search.delay_ps,
        worst=worst,
        note=note,
    )
