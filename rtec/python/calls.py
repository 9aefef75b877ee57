"""The commands as functions: the same words, the same answers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from rtec.dataset.dataset import Dataset
from rtec.dataset.many_rows import locked
from rtec.dataset.motion_residual import residual_dataset
from rtec.dataset.warm_log import is_warm_log, warm_log
from rtec.effects import LIBRARY, Effect, Library
from rtec.effects.own import as_effects
from rtec.errors import ArgumentError
from rtec.inference import model as inside
from rtec.inference.compare import check_model, compare as compared
from rtec.inference.diagnose import add as added, diagnose as diagnosed
from rtec.inference.shape_text import field_keys, read_shape
from rtec.predictors.motion_file import is_motion_file, read_motion
from rtec.python.data import Data, Source, data_of
from rtec.python.models import Model
from rtec.python.results import Comparison, Diagnosis, Document
from rtec.units import FREQUENCY, LENGTH, TIME, parse_quantity, parse_time_ps

Progress = Callable[[float], None]
"""Called with the share done."""


def compare(
    data: Data | Source,
    model: Model | str | Path | None = None,
    *,
    heldout: Data | Source | None = None,
    effects: Iterable[object] = (),
    observe: str | None = None,
) -> Comparison:
    """Fit what a model leaves open, and find how much it leaves of a measurement and where.

    Parameters
    ----------
    data, heldout
        A measurement, and another one that judges: what `read` returns or takes.
    model
        A `Model`, or its file, or that of a model of motion, of which the free run over a log is taken off; None: a
        perfect axis, of which all is left.
    effects
        Effects of your own that the file names.
    observe
        What is explained; see `read`.

    Raises
    ------
    ArgumentError, FileFormatError
        Data or model that cannot be read, or do not belong together.

    Examples
    --------
    >>> data = {"target_mm": [0.0, 5, 10, 0, 5, 10], "deviation_um": [0.0, 1, 2, 0.1, 1.1, 2.1],
    ...         "run": [1, 1, 1, 2, 2, 2]}
    >>> round(compare(data, Model("scale")).rms, 2)
    0.05
    """
    dataset, other, known = _inputs(data, model, heldout, effects, observe)
    return Comparison(compared(dataset, known, other))


def diagnose(
    data: Data | Source,
    effects: Iterable[object] = (),
    model: Model | str | Path | None = None,
    heldout: Data | Source | None = None,
    *,
    observe: str | None = None,
    lock: bool = False,
    seed: int = 0,
    progress: Progress | None = None,
) -> Diagnosis:
    """Find which effects a measurement shows, one by one, down to the noise floor.

    Parameters
    ----------
    data, model, heldout, observe
        As of `compare`.
    effects
        Effects of your own, which take part on equal terms with those of the library.
    lock
        Whether a fifth is reserved, and scored on at the end.
    seed
        Draws the readings that are looked at of a very long file.
    progress
        Called with the share done.

    Raises
    ------
    ArgumentError, FileFormatError
        As of `compare`; or an effect of yours that fails, with its line.

    Examples
    --------
    >>> x = [5.0 * k for k in range(9)] * 4
    >>> noise = [0.1, -0.2, 0.0, 0.2, -0.1, 0.1, 0.0]
    >>> found = diagnose({"target_mm": x, "deviation_um": [0.2 * v + noise[k % 7] for k, v in enumerate(x)],
    ...                   "run": [k // 9 for k in range(36)]})
    >>> found.verdict, found.effects
    ('NAMED', ('scale',))
    """
    dataset, other, known = _inputs(data, model, heldout, effects, observe)
    if lock and other is not None:
        raise ArgumentError("lock", True, "one of lock and heldout: either judges instead of blocks")
    if lock:
        dataset, other = locked(dataset)
    return Diagnosis(diagnosed(dataset, known, other, locked=lock, seed=seed, progress=progress))


def add(
    effect: str | Effect,
    data: Data | Source,
    model: Model | str | Path | None = None,
    heldout: Data | Source | None = None,
    *,
    effects: Iterable[object] = (),
    observe: str | None = None,
    seed: int = 0,
    **shape: object,
) -> Diagnosis:
    """Add an effect to a model, refit everything, and judge the result.

    Parameters
    ----------
    effect
        Its name, or an effect of your own.
    data, model, heldout, effects, observe, seed
        As of `diagnose`.
    shape
        Its parameters, as in a model file: ``period="6.35 mm", harmonics=2``. A scan finds them where there are none.

    Raises
    ------
    ArgumentError, FileFormatError
        As of `diagnose`; or an effect that the data cannot show, or that is there already.

    Examples
    --------
    >>> x = [0.0, 10.0, 20.0, 30.0] * 3
    >>> better = add("scale", {"target_mm": x, "deviation_um": [0.1 * v + (k % 3) for k, v in enumerate(x)]})
    >>> better.rms_after < better.rms_before
    True
    """
    own = [] if isinstance(effect, str) else [effect]
    dataset, other, known = _inputs(data, model, heldout, [*effects, *own], observe)
    what = dataset.library.named(effect) if isinstance(effect, str) else as_effects([effect])[0]
    keys = field_keys(what.shape_type)
    for key in shape:
        if key not in keys:
            raise ArgumentError(key, "", ", ".join(keys) or "nothing", problem=f"is no parameter of {what.name}")
    wanted = read_shape(what, shape, dataset.units, name=str)
    return Diagnosis(added(what.name, dataset, known, other, shape=wanted, seed=seed))


def train(
    data: Data | Source,
    heldout: Data | Source | None = None,
    *,
    effects: Iterable[object] = (),
    observe: str | None = None,
    blocks: str | None = None,
    budget: str = "40 s",
    starts: int = 10,
    seed: int = 0,
) -> Document:
    """Fit every kind of predictor to a measurement, and compare them by readings that none has seen.

    Parameters
    ----------
    data, heldout, effects, seed
        As of `diagnose`.
    observe, blocks
        Of the log of a warm machine: the displacement, as ``ch3`` (None: all), and a column whose changes start the
        blocks.
    budget
        Time that all networks share; of a warm machine, that all methods share.
    starts
        Trainings of a network, from other weights.

    Raises
    ------
    ArgumentError, FileFormatError
        A measurement of which no predictor of positions or of a warm machine can be made.
    """
    measured = data_of(data)
    observe = measured.observe if observe is None else observe
    if is_warm_log(measured.measurement, observe):
        return _train_warm(measured, heldout, observe, blocks, parse_quantity(budget, TIME, name="budget"), seed)
    if blocks is not None:
        why = "a time, temperatures or the speed of a spindle, and displacements"
        raise ArgumentError("blocks", blocks, "no blocks but for the log of a warm machine", why)
    from rtec.predictors.fitting.training import Effort
    from rtec.report.figures_training import training_figure
    from rtec.report.training import training_document, training_sentence
    from rtec.training import compare_predictors

    dataset, other, _ = _inputs(measured, None, heldout, effects, observe)
    budget_s = parse_quantity(budget, TIME, name="budget")
    result = compare_predictors(dataset, other, effort=Effort(starts=starts), budget_s=budget_s, seed=seed)
    return Document(training_document(result), training_sentence(result), {"errors": lambda: training_figure(result)})


def _train_warm(
    data: Data, heldout: Data | Source | None, observe: str | None, blocks: str | None, budget_s: float, seed: int
) -> Document:
    from rtec.dataset.warm_blocks import FEWEST_BLOCKS
    from rtec.report.figures_warm import warm_figure
    from rtec.report.warm_training import warm_document, warm_sentence
    from rtec.training.compare_warm import compare_warm

    fewest = FEWEST_BLOCKS if heldout is None else FEWEST_BLOCKS - 1
    log = warm_log(data.measurement, observe=observe, blocks=blocks, fewest_blocks=fewest)
    other = None if heldout is None else warm_log(data_of(heldout).measurement, like=log)
    result = compare_warm(log, other, budget_s=budget_s, seed=seed)
    return Document(warm_document(result), warm_sentence(result), {"warm": lambda: warm_figure(result)})


def simulate(
    design: str,
    frequency: str,
    corrections: int,
    cycles: int,
    *,
    timing: str = "fast",
    direction: int = 1,
    phase_error: str = "0deg",
    jitter: str = "0ns",
    seed: int = 0,
    vcd: str | Path | None = None,
) -> Document:
    """Send an encoder's edges through the box into the controller, and compare the counts.

    Parameters
    ----------
    design
        ``original``, ``a``, ``b`` or ``c``.
    frequency
        Of the encoder's square waves: "500kHz".
    corrections
        Steps asked for; below zero counts are taken away.
    cycles
        Travel; a cycle is four counts.
    timing
        ``8051`` or ``fast``.
    direction
        Of the motion, +1 or -1.
    phase_error, jitter
        Of the encoder: "10deg", "5ns".
    seed
        Of the jitter.
    vcd
        File for the waveforms of both sides.

    Raises
    ------
    ArgumentError
        A design, a quantity or a number that is not allowed.

    Examples
    --------
    >>> result = simulate("c", "500kHz", corrections=40, cycles=1000)
    >>> result["controller_counts"] - result["encoder_counts"], result["audit"]
    (80, True)
    """
    from rtec.axis import Encoder, Imperfections
    from rtec.injector import Design, InjectorSettings, Processor, Timing
    from rtec.machine import OpenPath, simulate as simulated
    from rtec.report.terminal_simulate import verdict
    from rtec.units import ANGLE

    if timing not in [one.value for one in Processor]:
        raise ArgumentError("timing", repr(timing)[:60], "8051 or fast")
    which = Design.named(design)
    flaws = Imperfections(
        phase_error_deg=parse_quantity(phase_error, ANGLE, name="phase_error"),
        jitter_ps=parse_time_ps(jitter, name="jitter"),
    )
    path = OpenPath(
        injector=InjectorSettings(design=which, timing=Timing.of(which, Processor(timing))),
        encoder=Encoder(seed=seed, imperfections=flaws),
        frequency_hz=parse_quantity(frequency, FREQUENCY, name="frequency"),
        cycles=cycles,
        corrections=corrections,
        direction=direction,
    )
    result = simulated(path, vcd=None if vcd is None else Path(vcd))
    return Document(result.to_dict(), verdict(path, result))


def run(
    study: str | Path | None = None,
    output: str | Path | None = None,
    *,
    repeatability: str | None = None,
    seed: int | None = None,
    progress: Progress | None = None,
) -> Document:
    """Calibrate an axis, find what is wrong with it, correct it with each insertion design, and report it all.

    Parameters
    ----------
    study
        A study file; the built-in one without.
    output
        Folder of the report; none is written without.
    repeatability
        Standard deviation of a reading: "1um".
    seed
        Of the readings' noise.
    progress
        Called with the share done.

    Raises
    ------
    ArgumentError, FileFormatError, OutputError
        A study or an option that is wrong, or a folder that cannot be written.
    """
    from dataclasses import replace

    from rtec.io import report_folder
    from rtec.report.document import study_document
    from rtec.report.folder import write_report
    from rtec.study import builtin_study, read_study, run_study
    from rtec.study.definition import checked_repeatability

    what = builtin_study() if study is None else read_study(Path(study))
    if repeatability is not None:
        repeatability_mm = checked_repeatability(parse_quantity(repeatability, LENGTH, name="repeatability"))
        what = replace(what, repeatability_mm=repeatability_mm)
    if seed is not None:
        what = replace(what, seed=seed)
    result = run_study(what, progress=lambda _, share: None if progress is None else progress(share))
    more: dict[str, str] = {}
    if output is not None:
        with report_folder(Path(output), what.name) as folder:
            more["report"] = str(write_report(result, folder))
    said = "every count is accounted for" if result.good else "a count is not accounted for, or a run was held"
    return Document(study_document(result) | more, f"study {what.name}: {said}")


def _inputs(
    data: Data | Source,
    model: Model | str | Path | None,
    heldout: Data | Source | None,
    effects: Iterable[object],
    observe: str | None,
) -> tuple[Dataset, Dataset | None, inside.Model | None]:
    """Return the measurement, the one that judges and the model, as the engine takes them."""
    own = as_effects([effects] if isinstance(effects, Effect | type) else list(effects))
    if isinstance(model, str | Path):
        if is_motion_file(model):
            return *_left_by_motion(data, model, heldout, own, observe), None
        model = Model.read(model, own)
    library: Library = (LIBRARY if model is None else model.library).with_own(own)
    wanted = observe if observe is not None or model is None else model.observe
    dataset = data_of(data).dataset(library, observe=wanted)
    other = None if heldout is None else data_of(heldout).dataset(library, like=dataset)
    known = None if model is None else model.inside(dataset.units)
    if known is not None:
        for measured in (dataset,) if other is None else (dataset, other):
            check_model(known, measured)
    return dataset, other, known


def _left_by_motion(
    data: Data | Source,
    model: str | Path,
    heldout: Data | Source | None,
    own: Sequence[Effect],
    observe: str | None,
) -> tuple[Dataset, Dataset | None]:
    """Return what a model of motion leaves of a log, and of the one that judges."""
    if observe is not None:
        raise ArgumentError("observe", observe, "none with a model of motion: what it leaves is explained")
    known, library, log = read_motion(model), LIBRARY.with_own(own), data_of(data)
    dataset = residual_dataset(known, log.measurement, facts=log.facts, library=library)
    if heldout is None:
        return dataset, None
    other = data_of(heldout)
    return dataset, residual_dataset(known, other.measurement, facts=other.facts, library=library, like=dataset)
