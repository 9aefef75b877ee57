"""A study: what is measured, on which axis, corrected by which designs - read from a TOML file."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from importlib import import_module, resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtec.axis import Encoder, Imperfections, Limits, ProfileShape, Servo
from rtec.board import Microcontroller
from rtec.checks import number_within
from rtec.controller import IllegalPolicy, ReceiverSettings
from rtec.effects import LIBRARY, Library
from rtec.errors import ArgumentError, FileFormatError, unknown
from rtec.heat.approach import approach
from rtec.inference.static_predictor import LeftOut
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.io import Section, brief, choice, parse_toml, read_toml
from rtec.machine import Laser, Machine
from rtec.machine.fault_kinds import FAULTS_OF_WORDS
from rtec.machine.faults import Fault, FaultPlace, Trigger, check_apart
from rtec.metrology import MachineAxis, MeasuringPlan
from rtec.metrology.measuring_plan import LATHE_MM
from rtec.predictors import Predictor
from rtec.requester.settings import HandshakeSettings, Outside
from rtec.study.models import (
    LEARNED,
    axis_error_of,
    check_calibration,
    check_dwells,
    check_feed,
    check_range,
    check_sizes,
    model_of,
)
from rtec.units import ACCELERATION, ANGLE, FREQUENCY, JERK, LENGTH, RATE, SPEED, TIME

if TYPE_CHECKING:
    from rtec.study.heat import HeatStudy

UNITS = ("um", "mm", "inch")
_MOST_HAPPENINGS = 100
MOST_ROUNDS = 2
"""Of calibrations: what the targets of the first one hide, those of the second do not."""
MAX_DRIVE_MM_S = 1e4
"""What the drive does at most, however fast the axis may be."""
_FAULT_KEYS = ("kind", "from", "until", "trigger")
_SECTIONS = (
    "axis", "encoder", "servo", "program", "laser", "calibration", "controller", "box", "handshake", "predictor",
    "figures",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """Everything that ``rtec run`` needs to know.

    Examples
    --------
    >>> study = builtin_study()
    >>> study.name, study.plan.number_of_readings, [design.value for design in study.designs]
    ('lathe', 760, ['original', 'a', 'b', 'c'])
    """

    name: str
    title: str
    file: str = field(compare=False)
    """File that it was read from; empty for the built-in study."""
    unit: str
    """Of tables and plots."""
    axis_error: Predictor
    period_mm: float | None
    """Of the cyclic error."""
    limits: Limits
    shape: ProfileShape
    encoder: Encoder
    servo: Servo
    plan: MeasuringPlan
    laser: Laser
    repeatability_mm: float
    """Standard deviation of one reading; 0 for none."""
    seed: int
    receiver: ReceiverSettings
    table_interval_mm: float
    designs: tuple[Design, ...]
    processor: Processor
    real_edges: RealEdges
    gate_margin: float
    rest_ps: int
    handshake: HandshakeSettings
    predictor: str
    """What the PC's predictor is, as the file says it."""
    model: Predictor
    """The PC's model of the error; that of a perfect axis where it has to be learned first."""
    left_out: tuple[LeftOut, ...]
    """Effects of a model file that the predictor cannot hold."""
    calibration: MeasuringPlan
    """The measurement from which the PC learns."""
    rounds: int
    """In how many rounds it may do so: a second one at the targets that the first search asks for."""
    feeds_mm_s: tuple[float, ...]
    span_mm: float
    hold_growth_mm: float
    hold_time_constant_s: float
    """Of the axis that is held while it grows in first order."""
    faults: tuple[Fault, ...] = ()
    """What goes wrong while the rows are measured."""
    probing: tuple[tuple[int, int], ...] = ()
    """Times (from, until) in ps at which the PC probes while the rows are measured."""
    library: Library = LIBRARY
    """The effects that the search of a calibration may find, with those of one's own."""
    heat: HeatStudy | None = None
    """A machine that warms over a shift; None for a cold one alone."""
    firmware: Microcontroller | None = None
    """The processor that runs the real firmware in the box; None for the behavioural model of it."""

    @property
    def learns(self) -> bool:
        """Whether the PC's predictor is learned from a calibration."""
        return self.predictor == LEARNED

    @property
    def box_processor(self) -> str:
        """What is at work in the box: a timing profile, or a processor with its firmware."""
        return self.processor.value if self.firmware is None else f"{self.firmware.name} with its firmware"

    def timing(self, design: Design) -> Timing:
        """Return the timing of a design on the study's processor."""
        return replace(Timing.of(design, self.processor), rest_ps=self.rest_ps, gate_margin=self.gate_margin)

    def injector(self, design: Design) -> InjectorSettings:
        """Return the box with a design in it."""
        return InjectorSettings(design=design, timing=self.timing(design), real_edges=self.real_edges)


def builtin_text(name: str = "lathe") -> str:
    """Return a built-in study, ``lathe`` or ``warm``, as the file that users copy."""
    return resources.files("rtec.study").joinpath(f"{name}.toml").read_text(encoding="utf-8")


def builtin_study(name: str = "lathe") -> Study:
    """Return a built-in study: ``lathe``, or ``warm``, a machine that warms over a shift."""
    return _study(parse_toml(builtin_text(name), f"built-in study {name}"), f"built-in study {name}", Path())


def read_study(path: Path, library: Library = LIBRARY) -> Study:
    """Read a study from a TOML file; keys that it leaves out have the built-in study's values.

    ``library`` holds the effects of one's own that its search or its model file may name.

    Raises
    ------
    FileFormatError
        A file that is no TOML, or a key or table that does not exist; the nearest name is suggested.
    ArgumentError
        A value without its unit or outside its range.
    """
    return _study(read_toml(path), path, path.parent, library)


def _study(given: dict[str, Any], path: str | Path, folder: Path, library: Library = LIBRARY) -> Study:
    builtin = parse_toml(builtin_text(), "built-in study")
    top = Section(path, "", given, builtin, optional=("faults", "heat", "probing"))

    def section(name: str, *optional: str) -> Section:
        return Section(path, name, top.raw(name), builtin[name], optional=optional)

    # tables given are merged key by key with the built-in ones, so only the top level is taken as it stands
    parts = {name: section(name, *(("jerk",) if name == "axis" else ())) for name in _SECTIONS}
    unit = top.text("unit")
    if unit not in UNITS:
        raise unknown(top.where("unit"), unit, UNITS, noun="unit of results")
    axis_error = axis_error_of(parts["axis"], folder)
    try:
        with parts["axis"].naming(axis_error="error"):
            Machine(axis_error=axis_error)
        plan = _plan(parts["program"])
        check_range(parts["program"], plan, "the axis's error", axis_error)
        model, left_out = model_of(parts["predictor"], folder, axis_error, plan, library)
        check_range(parts["program"], plan, "the predictor", model)
        study = Study(
            name=_plain_name(top),
            title=top.text("title"),
            file=str(path) if isinstance(path, Path) else "",
            unit=unit,
            axis_error=axis_error,
            predictor=parts["predictor"].text("model"),
            model=model,
            left_out=left_out,
            library=library,
            calibration=_calibration(parts["calibration"], plan),
            rounds=parts["calibration"].whole("rounds", 1, MOST_ROUNDS),
            **_axis(parts["axis"]),
            encoder=_encoder(parts["encoder"]),
            servo=_servo(parts["servo"], parts["axis"]),
            plan=plan,
            **_laser(parts["laser"]),
            **_controller(parts["controller"]),
            **_box(parts["box"]),
            handshake=_handshake(parts["handshake"]),
            **_figures(parts["figures"]),
            heat=_heat(top, path, plan, folder) if top.has("heat") else None,
            faults=tuple(_fault(section) for section in _happenings(top, path, "faults", _FAULT_KEYS)),
            probing=tuple(_probing(section) for section in _happenings(top, path, "probing", ("from", "until"))),
        )
        check_apart(study.faults, study.probing)
        with parts["box"].naming(rest_ps="rest"):
            for design in Design:
                study.timing(design)
        check_feed(parts["program"], plan, study.limits)
        check_dwells(parts["laser"], plan, study.laser, "program")
        check_sizes(parts["program"], parts["controller"], plan, study.table_interval_mm)
        if study.learns:
            check_dwells(parts["laser"], study.calibration, study.laser, "calibration")
            check_calibration(parts["calibration"], study.calibration)
    except ArgumentError as error:
        where = error.name if str(path) in error.name else f"{path}: {error.name}"
        raise ArgumentError(where, brief(error.value), error.allowed, error.hint, problem=error.problem) from None
    return study


def _heat(top: Section, path: str | Path, plan: MeasuringPlan, folder: Path) -> HeatStudy:
    """Return what the table ``[heat]`` asks for; what it needs is loaded where there is one."""
    heat = import_module("rtec.study.heat")
    section = Section(path, "heat", top.raw("heat"), heat.DEFAULTS, optional=heat.OPTIONAL)
    found: HeatStudy = heat.heat_of(section, plan, folder)
    return found


def _happenings(top: Section, path: str | Path, name: str, keys: tuple[str, ...]) -> list[Section]:
    """Return the tables ``[[name]]`` of a study; there may be none."""
    given = top.raw(name) if top.has(name) else []
    if not isinstance(given, list) or len(given) > _MOST_HAPPENINGS:
        allowed = f"at most {_MOST_HAPPENINGS} tables [[{name}]]"
        raise FileFormatError(path, None, brief(f"{name} = {given!r}"), allowed)
    return [Section(path, f"{name}[{k + 1}]", each, {}, optional=keys) for k, each in enumerate(given)]


def _fault(section: Section) -> Fault:
    kind = section.choice("kind", FAULTS_OF_WORDS)
    if section.time_ps("from") < 0:
        raise section.refused("from", "a time of the run, from 0 s on")
    with section.naming(from_ps="from", until_ps="until", trigger="trigger"):
        return Fault(
            kind=kind,
            place=1 if kind.place is FaultPlace.AXIS else None,
            from_ps=section.time_ps("from"),
            until_ps=section.time_ps("until") if section.has("until") else None,
            trigger=section.choice("trigger", Trigger) if section.has("trigger") else Trigger.AT_ONCE,
        )


def _probing(section: Section) -> tuple[int, int]:
    from_ps, until_ps = section.time_ps("from"), section.time_ps("until")
    if from_ps < 0:
        raise section.refused("from", "a time of the run, from 0 s on")
    if from_ps >= until_ps:
        raise section.refused("until", f"a time after {section.text('from')}")
    return from_ps, until_ps


def _plain_name(top: Section) -> str:
    name = top.text("name")
    if not all(letter.isalnum() or letter in "-_" for letter in name) or len(name) > 60:
        raise top.refused("name", "letters, digits, - and _", problem="cannot be the name of the report's folder")
    return name


def _calibration(section: Section, plan: MeasuringPlan) -> MeasuringPlan:
    """Return the calibration: over the program's travel, in steps that divide it evenly."""
    at_most = section.quantity("increment", LENGTH)
    travel = plan.end_mm - plan.start_mm
    runs = section.whole("runs", 1, 99)
    if not at_most > 0.0:
        raise section.refused("increment", "a length above zero")
    steps = max(math.ceil(travel / at_most - 1e-6), 1)
    with section.naming(dwell_s="dwell", increment_mm="increment"):
        return replace(plan, increment_mm=travel / steps, dwell_s=section.quantity("dwell", TIME), runs=runs)


def _axis(section: Section) -> dict[str, Any]:
    jerk = section.quantity("jerk", JERK) if section.has("jerk") else None
    speed = section.quantity("max_speed", SPEED)
    with section.naming(max_speed_mm_s="max_speed", max_acceleration_mm_s2="acceleration", max_jerk_mm_s3="jerk"):
        limits = Limits(
            max_speed_mm_s=speed,
            max_acceleration_mm_s2=section.quantity("acceleration", ACCELERATION),
            max_jerk_mm_s3=jerk,
            rapid_mm_s=speed,
        )
    period = section.quantity("cyclic_period", LENGTH)
    if period < 0.0:
        raise section.refused("cyclic_period", "a length above zero, or 0 mm for none")
    shape = ProfileShape.TRAPEZOIDAL if jerk is None else ProfileShape.JERK_LIMITED
    return {"limits": limits, "shape": shape, "period_mm": period or None}


def _encoder(section: Section) -> Encoder:
    lines = {"phase_error_deg": "phase_error", "phase_error_deg with duty errors": "phase_error"}
    duties = {key: key for key in ("duty_error_a", "duty_error_b")}
    with section.naming(count_mm="count", jitter_ps="jitter", **lines, **duties):
        return Encoder(
            count_mm=section.quantity("count", LENGTH),
            home_state=section.whole("home_state", 0, 3),
            seed=section.whole("seed", 0, 1 << 60),
            imperfections=Imperfections(
                phase_error_deg=section.quantity("phase_error", ANGLE),
                duty_error_a=section.share("duty_error_a"),
                duty_error_b=section.share("duty_error_b"),
                jitter_ps=section.time_ps("jitter"),
            ),
        )


def _servo(section: Section, axis: Section) -> Servo:
    with section.naming(period_ps="period", gain_per_s="gain", lag_s="lag", dither_hz="dither_frequency"):
        return Servo(
            period_ps=section.time_ps("period"),
            gain_per_s=section.quantity("gain", RATE),
            lag_s=section.quantity("lag", TIME),
            feedforward=section.number("feedforward", 0.0, 1.0),
            deadband_counts=section.number("deadband", 0.0, 1e6),
            dither_counts=section.number("dither", 0.0, 1e6),
            dither_hz=section.quantity("dither_frequency", FREQUENCY),
            max_speed_mm_s=min(2.0 * axis.quantity("max_speed", SPEED), MAX_DRIVE_MM_S),
        )


def _plan(section: Section) -> MeasuringPlan:
    ends = {f"{key}_mm": section.quantity(key, LENGTH) for key in ("start", "end", "increment", "overshoot")}
    keys = {name: name.removesuffix("_mm") for name in ends}
    with section.naming(dwell_s="dwell", feed_mm_s="feed", maximum_mm="end", **keys):
        return MeasuringPlan(
            **ends,
            dwell_s=section.quantity("dwell", TIME),
            runs=section.whole("runs", 1, 99),
            feed_mm_s=section.quantity("feed", SPEED),
            axis=MachineAxis(maximum_mm=max(LATHE_MM, ends["end_mm"] + ends["overshoot_mm"])),
        )


def _laser(section: Section) -> dict[str, Any]:
    with section.naming(window_mm="window", dwell_s="dwell", repeatability_mm="repeatability"):
        laser = Laser(window_mm=section.quantity("window", LENGTH), dwell_s=section.quantity("dwell", TIME))
        spread = checked_repeatability(section.quantity("repeatability", LENGTH))
    return {"laser": laser, "repeatability_mm": spread, "seed": section.whole("seed", 0, 1 << 60)}


def checked_repeatability(repeatability_mm: float) -> float:
    """Return the standard deviation of a reading if it is neither negative nor absurd."""
    return number_within("repeatability_mm", repeatability_mm, 0.0, 100.0)


def _controller(section: Section) -> dict[str, Any]:
    interval = section.quantity("table_interval", LENGTH)
    if not 1e-3 <= interval <= 1e4:
        raise section.refused("table_interval", "a length from 1 um to 10 m")
    with section.naming(clock_hz="filter_clock", counter_bits="counter_bits"):
        receiver = ReceiverSettings(
            filter_samples=section.whole("filter_samples", 0, 1_000_000),
            clock_hz=_whole_hertz(section, "filter_clock"),
            policy=section.choice("policy", IllegalPolicy),
            counter_bits=section.whole("counter_bits", 0, 62),
        )
    return {"receiver": receiver, "table_interval_mm": interval}


def _whole_hertz(section: Section, key: str) -> int:
    clock_hz = section.quantity(key, FREQUENCY)
    if abs(clock_hz - round(clock_hz)) > 1e-3:  # what is left of a conversion of units is less
        raise section.refused(key, "a whole number of hertz")
    return round(clock_hz)


def _box(section: Section) -> dict[str, Any]:
    designs = [choice(section.where("designs"), name, Design) for name in section.texts("designs")]
    if len(set(designs)) < len(designs):
        raise section.refused("designs", "each design once")
    return {
        "designs": tuple(designs),
        "processor": section.choice("processor", Processor),
        "real_edges": section.choice("real_edges", RealEdges),
        "gate_margin": section.number("gate_margin", 0.0, 100.0),
        "rest_ps": section.time_ps("rest"),
    }


def _handshake(section: Section) -> HandshakeSettings:
    times = {"box_period_ps": "box_period", "pc_period_ps": "pc_period", "latency_ps": "latency"}
    low = {"update_ps": "data_valid_low", "retry_ps": "data_valid_low", "reversal_mm": "direction_hysteresis"}
    box_ps, low_ps = section.time_ps("box_period"), section.time_ps("data_valid_low")
    # the PC looks again so soon that it meets valid words before the box's next sample
    retry_ps = max(min(HandshakeSettings().retry_ps, section.time_ps("pc_period"), (box_ps - low_ps) // 2), 1_000_000)
    with section.naming(**times, **low):
        return HandshakeSettings(
            retry_ps=retry_ps,
            window_steps=section.whole("window", 1, 32767),
            grace_readings=section.whole("grace", 0, 1000),
            box_period_ps=box_ps,
            pc_period_ps=section.time_ps("pc_period"),
            latency_ps=section.time_ps("latency"),
            update_ps=low_ps,
            reversal_mm=section.quantity("direction_hysteresis", LENGTH),
            outside=section.choice("outside", Outside),
        )


def _figures(section: Section) -> dict[str, Any]:
    feeds = sorted(section.quantities("feeds", SPEED))
    span = section.quantity("span", LENGTH)
    if any(not 1e-3 <= feed <= 1e4 for feed in feeds):
        raise section.refused("feeds", "speeds from 0.001 mm/s to 10 m/s")
    if not 1.0 <= span <= 1e4:
        raise section.refused("span", "a length from 1 mm to 10 m")
    with section.naming(shift_mm="hold_growth", time_constant_s="hold_time_constant"):
        growth_mm, constant_s = section.quantity("hold_growth", LENGTH), section.quantity("hold_time_constant", TIME)
        approach(shift_mm=growth_mm, time_constant_s=constant_s)
    return {
        "feeds_mm_s": tuple(feeds),
        "span_mm": span,
        "hold_growth_mm": growth_mm,
        "hold_time_constant_s": constant_s,
    }
