"""One positioning test, written in a hundred ways: as instruments, spreadsheets and people write such files.

The readings are made here from their definition, and every layout writes them by itself, with none of the code that
reads them. Most layouts are read right: the readings come out again. A few cannot be told and have to be asked about.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any

TARGETS = (0.0, 100.0, 250.0, 400.0, 500.0)
RUNS = 3


@dataclass(frozen=True)
class Reading:
    run: int
    direction: int
    target_mm: float
    deviation_um: float
    time_s: float

    @property
    def actual_mm(self) -> float:
        return self.target_mm + self.deviation_um / 1000


def readings(directions: Iterable[int] = (1, -1)) -> list[Reading]:
    """Return the readings in the order in which they were taken; every number has at most four decimals in mm."""
    found = []
    for run in range(1, RUNS + 1):
        for direction in directions:
            for target in sorted(TARGETS, reverse=direction < 0):
                deviation = target / 100 + (2.5 if direction < 0 else 0.0) + 0.3 * run + 0.1 * (target % 7)
                found.append(Reading(run, direction, target, round(deviation, 1) - 3.0, 7.0 * len(found)))
    return found


@dataclass(frozen=True)
class Foreign:
    """A file: how it is called, what is in it, and what has to be said of it.

    ``asks`` is what the question has to name where the file cannot be read without one; ``maps``, ``sheet``,
    ``decimal`` and ``table`` are the answer to it, where there is one. ``missing`` readings have no value in it.
    """

    name: str
    data: bytes
    asks: str = ""
    maps: tuple[str, ...] = ()
    sheet: str | None = None
    decimal: str | None = None
    table: int | None = None
    missing: int = 0
    notes: tuple[str, ...] = ()
    expected: tuple[Reading, ...] = field(default_factory=lambda: tuple(readings()))


ALL: list[Callable[[], Foreign]] = []


def layout(make: Callable[[], Foreign]) -> Callable[[], Foreign]:
    ALL.append(make)
    return make


def comma(value: float, decimals: int = 4) -> str:
    return f"{value:.{decimals}f}".replace(".", ",")


def text(lines: Iterable[str], end: str = "\n") -> str:
    return end.join(lines) + end


def rows(line: Callable[[Reading], str], directions: Iterable[int] = (1, -1)) -> list[str]:
    return [line(one) for one in readings(directions)]


def plain(separator: str) -> Callable[[Reading], str]:
    """Return what writes run, direction, target in mm and deviation in µm."""
    return lambda r: separator.join(map(str, (r.run, r.direction, r.target_mm, r.deviation_um)))


def listed(
    name: str, heading: str | tuple[str, ...], line: Callable[[Reading], str], *, end: str = "\n",
    encoding: str = "utf-8", **more: Any,
) -> None:  # fmt: skip
    """Add a layout with a reading a line under its heading, or under several lines of it."""
    head = [heading] if isinstance(heading, str) else heading
    ALL.append(lambda: Foreign(name, text([*head, *rows(line)], end).encode(encoding), **more))


def by_pass(target: float) -> dict[tuple[int, int], Reading]:
    return {(one.run, one.direction): one for one in readings() if one.target_mm == target}


listed("contract.csv", ("# axis: x", "run,direction,target_mm,deviation_um"), plain(","))
listed("semicolons.csv", "run;direction;target_mm;deviation_um", plain(";"))
listed("tabs.txt", "run\tdirection\ttarget_mm\tdeviation_um", plain("\t"))
listed(
    "spaces.dat",
    "run dir  target_mm deviation_um",
    lambda r: f"{r.run:3d} {r.direction:3d} {r.target_mm:10.3f} {r.deviation_um:8.2f}",
)
listed("bars.txt", "Run | Dir | Target [mm] | Error [um]", plain(" | "))
listed(
    "komma.csv",
    "Lauf;Richtung;Soll [mm];Abweichung [µm]",
    lambda r: f"{r.run};{r.direction};{comma(r.target_mm, 1)};{comma(r.deviation_um, 2)}",
    end="\r\n",
    encoding="latin-1",
)
listed(
    "komma.txt",
    "Sollwert/mm\tIstwert/mm\tRichtung\tLauf",
    lambda r: f"{comma(r.target_mm, 3)}\t{comma(r.actual_mm)}\t{'+' if r.direction > 0 else '-'}\t{r.run}",
)
listed(
    "quoted.csv",
    "Lauf,Richtung,Soll (mm),Abweichung (um)",
    lambda r: f'{r.run},{r.direction},"{comma(r.target_mm, 1)}","{comma(r.deviation_um, 2)}"',
)


@layout
def thousands_german() -> Foreign:
    def big(value: float) -> str:
        return f"{value * 1000:,.2f}".translate(str.maketrans(",.", ".,"))

    body = rows(lambda r: f"{r.run};{r.direction};{big(r.target_mm)};{comma(r.deviation_um, 2)}")
    return Foreign("tausender.csv", text(["Lauf;Richtung;Soll [µm];Abweichung [µm]", *body]).encode())


listed(
    "schweiz.csv",
    "Lauf;Richtung;Soll [µm];Abweichung [µm]",
    lambda r: f"{r.run};{r.direction};{r.target_mm * 1000:,.1f};{r.deviation_um}".replace(",", "'"),
)
listed(
    "thousands.csv",
    "run,dir,nominal (um),error (um)",
    lambda r: f'{r.run},{r.direction},"{r.target_mm * 1000:,.1f}",{r.deviation_um}',
)


@layout
def three_decimals_or_thousands() -> Foreign:
    """100,000 and 12,300: a hundred with three decimals, or a hundred thousand; nobody can tell."""
    shifted = [replace(r, deviation_um=r.deviation_um + 10) for r in readings() if r.target_mm]
    body = [f"{r.run};{r.direction};{comma(r.target_mm, 3)};{comma(r.deviation_um, 3)}" for r in shifted]
    lines = text(["Lauf;Richtung;Soll [mm];Abweichung [µm]", *body])
    return Foreign("offen.csv", lines.encode(), asks="--decimal comma", decimal="comma", expected=tuple(shifted))


listed(
    "sep.csv",
    ("sep=;", "Run;Direction;Target (mm);Error (µm)"),
    lambda r: f"{r.run};{r.direction};{comma(r.target_mm, 1)};{comma(r.deviation_um, 2)}",
    end="\r\n",
)
listed(
    "exponents.csv",
    "run,direction,target_m,deviation_m",
    lambda r: f"{r.run},{r.direction},{r.target_mm / 1000:.6E},{r.deviation_um / 1e6:.6E}",
)
listed(
    "minus.csv",
    "Run;Direction;Target [mm];Deviation [µm]",
    lambda r: f"{r.run};{r.direction};{r.target_mm};{r.deviation_um}".replace("-", "\u2212"),
)
listed(
    "latin1.csv",
    "Position [mm],Abweichung (µm),Richtung,Lauf",
    lambda r: f"{r.target_mm},{r.deviation_um},{r.direction},{r.run}",
    encoding="latin-1",
)
listed(
    "bom.csv",
    "Position [mm];Abweichung (µm);Richtung;Lauf",
    lambda r: f"{r.target_mm};{r.deviation_um};{r.direction};{r.run}",
    encoding="utf-8-sig",
)
listed(
    "unicode.txt",
    "Position [mm]\tAbweichung (µm)\tRichtung\tLauf",
    lambda r: f"{r.target_mm}\t{r.deviation_um}\t{r.direction}\t{r.run}",
    end="\r\n",
    encoding="utf-16",
)
listed("big.csv", "run,direction,target_mm,deviation_um", plain(","), encoding="utf-16-be")
listed("mac.csv", "run,direction,target_mm,deviation_um", plain(","), end="\r")


@layout
def dos_end_of_file() -> Foreign:
    body = rows(lambda r: f"{r.run},{r.direction},{r.target_mm},{r.deviation_um}")
    return Foreign("DOS.CSV", text(["run,direction,target_mm,deviation_um", *body], "\r\n").encode() + b"\x1a")


@layout
def title_lines() -> Foreign:
    head = ["Positioniergenauigkeit X-Achse", "Maschine: VMC 500", "Datum: 22.11.2026", ""]
    body = rows(lambda r: f"{r.run};{r.direction};{comma(r.target_mm, 1)};{comma(r.deviation_um, 2)}")
    return Foreign("titel.csv", text([*head, "Lauf;Richtung;Soll [mm];Abweichung [µm]", *body]).encode("latin-1"))


@layout
def title_lines_with_separators() -> Foreign:
    head = ["Report;;;", "Machine;VMC 500;;", "Operator;A. Smith;;", ";;;"]
    body = rows(lambda r: f"{r.run};{r.direction};{r.target_mm};{r.deviation_um}")
    return Foreign("padded.csv", text([*head, "Run;Direction;Target [mm];Error [um]", *body]).encode())


listed("units.csv", ("Run;Direction;Nominal;Deviation", ";;mm;µm"), plain(";"))
listed(
    "units.txt",
    ("Target\tMeasured\tDir.\tRun", "[mm]\t[mm]\t[-]\t[-]"),
    lambda r: f"{r.target_mm}\t{r.actual_mm:.4f}\t{r.direction}\t{r.run}",
)


@layout
def sums_below() -> Foreign:
    body = rows(lambda r: f"{r.run};{r.direction};{r.target_mm};{r.deviation_um}")
    foot = ["", "Mean;;250;1.3", "Max;;500;5.0", "Inspected by A. Smith"]
    return Foreign(
        "sums.csv", text(["Run;Direction;Target [mm];Error [um]", *body, *foot]).encode(), notes=("left out",)
    )


listed(
    "trailing.csv",
    "Run;Direction;Target [mm];Error [um];;",
    lambda r: f"{r.run};{r.direction};{r.target_mm};{r.deviation_um};;",
)


@layout
def empty_lines_between_passes() -> Foreign:
    lines: list[str] = []
    for one in readings():
        if one.target_mm == (TARGETS[0] if one.direction > 0 else TARGETS[-1]):
            lines.append("")
        lines.append(f"{one.run},{one.direction},{one.target_mm},{one.deviation_um}")
    return Foreign("gaps.csv", text(["Run,Direction,Target (mm),Error (um)", *lines]).encode())


@layout
def line_numbers() -> Foreign:
    body = [f"{n};{r.run};{r.direction};{r.target_mm};{r.deviation_um}" for n, r in enumerate(readings(), 1)]
    return Foreign("numbered.csv", text(["No.;Run;Direction;Target [mm];Error [um]", *body]).encode())


listed(
    "english.csv",
    "Cycle,Commanded position (mm),Measured position (mm),dir",
    lambda r: f"{r.run},{r.target_mm},{r.actual_mm:.4f},{'forward' if r.direction > 0 else 'reverse'}",
)
listed("underscores.csv", "run,direction,nominal_mm,deviation_µm", plain(","))
listed("camel.csv", "RunNo,ApproachDirection,NominalPos [mm],LinearError [um]", plain(","))
listed(
    "francais.csv",
    "Série;Sens;Consigne (mm);Écart (µm)",
    lambda r: (
        f"{r.run};{'aller' if r.direction > 0 else 'retour'};{comma(r.target_mm, 1)};{comma(r.deviation_um, 1)}"
    ),
    encoding="latin-1",
)
listed("slash.csv", "Run;Direction;Position / mm;Deviation / µm", plain(";"))
listed("in.csv", "Run;Direction;Position in mm;Error in um", plain(";"))
listed(
    "inch.csv",
    "Run,Direction,Target (in),Error (thou)",
    lambda r: f"{r.run},{r.direction},{r.target_mm / 25.4:.10f},{r.deviation_um / 25.4:.10f}",
)
listed("istsoll.csv", "Lauf;Richtung;Sollposition [mm];Ist - Soll [µm]", plain(";"))
listed(
    "nounit.csv",
    "run,direction,nominal,error",
    plain(","),
    asks="nominal=target_mm",
    maps=("nominal=target_mm", "error=deviation_um"),
)
listed(
    "two.csv",
    "run,direction,Nominal [mm],Soll [mm],error [um]",
    lambda r: f"{r.run},{r.direction},{r.target_mm},{r.target_mm},{r.deviation_um}",
    asks="Soll [mm]=ignore",
    maps=("Soll [mm]=ignore",),
)
listed(
    "contradict.csv",
    ("Run;Direction;Target [mm];Error [um]", ";;mm;mm"),
    plain(";"),
    asks="Error [um]=",
    maps=("Error [um]=deviation_um",),
)
listed(
    "two_units.csv",
    "Run;Direction;Target [mm];deviation_um [mm]",
    plain(";"),
    asks="states um and mm",
    maps=("deviation_um [mm]=deviation_um",),
)
listed(
    "straight.csv",
    "Run,Direction,Target (mm),Error (um),Straightness error (um)",
    lambda r: f"{r.run},{r.direction},{r.target_mm},{r.deviation_um},{r.deviation_um / 3:.3f}",
)
listed(
    "stats.csv",
    "Run,Direction,Target (mm),Error (um),Mean error (um),Std (um)",
    lambda r: f"{r.run},{r.direction},{r.target_mm},{r.deviation_um},1.5,0.2",
)
listed(
    "signs.csv",
    "run,dir,target_mm,deviation_um",
    lambda r: f"{r.run},{'+' if r.direction > 0 else '-'},{r.target_mm},{r.deviation_um}",
)
listed(
    "arrows.csv",
    "Run;Approach;Target [mm];Error [µm]",
    lambda r: f"Run {r.run};{'↑' if r.direction > 0 else '↓'};{r.target_mm};{r.deviation_um}",
)


@layout
def german_directions() -> Foreign:
    way = {1: "vorwärts", -1: "rückwärts"}
    body = rows(lambda r: f"{r.run};{way[r.direction]};{comma(r.target_mm, 1)};{comma(r.deviation_um, 1)}")
    return Foreign("vor.csv", text(["Lauf;Anfahrrichtung;Soll [mm];Abw. [µm]", *body]).encode("latin-1"))


listed(
    "lr.csv",
    "run,Dir,target_mm,deviation_um",
    lambda r: f"{r.run},{'L' if r.direction > 0 else 'R'},{r.target_mm},{r.deviation_um}",
    notes=("took 'L' in column 'Dir' for forward",),
)
listed(
    "switch.csv",
    "Run;Direction;Target [mm];Error [um]",
    lambda r: f"{r.run};{int(r.direction < 0)};{r.target_mm};{r.deviation_um}",
    notes=("took '0' in column 'Direction' for forward",),
)
listed(
    "drawn.csv",
    "Run;Direction;Target [mm];Error [um]",
    lambda r: f"{r.run};{'->' if r.direction > 0 else '<-'};{r.target_mm};{r.deviation_um}",
)


@layout
def directions_not_understood() -> Foreign:
    names = {1: "AB", -1: "CD"}
    body = rows(lambda r: f"{r.run},{names[r.direction][r.run % 2]},{r.target_mm},{r.deviation_um}")
    return Foreign(
        "ab.csv", text(["run,Dir,target_mm,deviation_um", *body]).encode(), asks="Dir=ignore", maps=("Dir=ignore",)
    )


listed("nodirection.csv", "Run,Position (mm),Error (um)", lambda r: f"{r.run},{r.target_mm},{r.deviation_um}")


@layout
def iso_dates() -> Foreign:
    def moment(r: Reading) -> str:
        return f"2026-11-22T10:{int(r.time_s) // 60:02d}:{int(r.time_s) % 60:02d}.000Z"

    body = rows(lambda r: f"{moment(r)},{r.run},{r.direction},{r.target_mm},{r.deviation_um}")
    return Foreign("dates.csv", text(["Timestamp,Run,Direction,Target (mm),Error (um)", *body]).encode())


@layout
def clock_times_over_midnight() -> Foreign:
    def moment(r: Reading) -> str:
        s = int(23 * 3600 + 58 * 60 + r.time_s) % 86400
        return f"{s // 3600:02d}:{s % 3600 // 60:02d}:{s % 60:02d}"

    body = rows(lambda r: f"{moment(r)};{r.run};{r.direction};{r.target_mm};{r.deviation_um}")
    return Foreign(
        "uhrzeit.csv", text(["Uhrzeit;Lauf;Richtung;Soll [mm];Abweichung [µm]", *body]).encode(), notes=("midnight",)
    )


@layout
def date_and_time_columns() -> Foreign:
    def moment(r: Reading) -> str:
        return f"22.11.2026;10:{int(r.time_s) // 60:02d}:{int(r.time_s) % 60:02d}"

    body = rows(lambda r: f"{moment(r)};{r.run};{r.direction};{comma(r.target_mm, 1)};{comma(r.deviation_um, 1)}")
    return Foreign("datum.csv", text(["Datum;Zeit;Lauf;Richtung;Soll [mm];Abweichung [µm]", *body]).encode())


@layout
def empty_and_not_available() -> Foreign:
    body = rows(lambda r: f"{r.run};{r.direction};{r.target_mm};{r.deviation_um}")
    body[4] = body[4].rpartition(";")[0] + ";n/a"
    body[11] = body[11].rpartition(";")[0] + ";"
    lines = text(["Run;Direction;Target [mm];Error [um]", *body])
    return Foreign("empty.csv", lines.encode(), missing=2, notes=("2 of 30 rows are left out",))


@layout
def contract_with_an_empty_cell() -> Foreign:
    body = rows(lambda r: f"{r.run},{r.direction},{r.target_mm},{r.deviation_um}")
    body[7] = body[7].rpartition(",")[0] + ","
    lines = text(["run,direction,target_mm,deviation_um", *body])
    return Foreign("hole.csv", lines.encode(), missing=1, notes=("1 of 30 rows",))


listed(
    "notemp.csv",
    "run,direction,target_mm,deviation_um,temperature_degc",
    lambda r: f"{r.run},{r.direction},{r.target_mm},{r.deviation_um},",
)


@layout
def wide_runs_and_signs() -> Foreign:
    passes = [(run, way) for run in range(1, RUNS + 1) for way in (1, -1)]
    head = ["Position [mm]", *(f"{run}{'+' if way > 0 else '-'} [µm]" for run, way in passes)]
    body = [";".join([str(t), *(str(by_pass(t)[one].deviation_um) for one in passes)]) for t in TARGETS]
    return Foreign("wide.csv", text([";".join(head), *body]).encode())


@layout
def wide_two_heading_rows() -> Foreign:
    passes = [(run, way) for way in (1, -1) for run in range(1, RUNS + 1)]
    above = ["", "Forward", *[""] * (RUNS - 1), "Reverse", *[""] * (RUNS - 1)]
    head = ["Target [mm]", *(f"Run {run} [um]" for run, _ in passes)]
    body = [",".join([str(t), *(str(by_pass(t)[one].deviation_um) for one in passes)]) for t in TARGETS]
    return Foreign("spanned.csv", text([",".join(above), ",".join(head), *body]).encode())


@layout
def wide_with_unit_row() -> Foreign:
    passes = [(run, way) for run in range(1, RUNS + 1) for way in (1, -1)]
    head = ["Sollposition", *(f"Lauf {run} {'vor' if way > 0 else 'rück'}" for run, way in passes)]
    body = [";".join([comma(t, 1), *(comma(by_pass(t)[one].deviation_um, 1) for one in passes)]) for t in TARGETS]
    return Foreign("breit.csv", text([";".join(head), ";".join(["mm", *["µm"] * len(passes)]), *body]).encode())


@layout
def wide_actual_positions() -> Foreign:
    passes = [(run, way) for run in range(1, RUNS + 1) for way in (1, -1)]
    head = ["Target (mm)", *(f"Run {run} {'fwd' if way > 0 else 'rev'} (mm)" for run, way in passes)]
    body = [",".join([str(t), *(f"{by_pass(t)[one].actual_mm:.4f}" for one in passes)]) for t in TARGETS]
    return Foreign("wide_actual.csv", text([",".join(head), *body]).encode(), notes=("near their targets",))


@layout
def wide_bare_numbers() -> Foreign:
    numbers = range(1, RUNS + 1)
    lines = [f"Deviation (um){',' * (RUNS + 1)}", "Target (mm),Direction," + ",".join(map(str, numbers))]
    for way in (1, -1):
        for target in TARGETS:
            found = by_pass(target)
            lines.append(
                f"{target},{'+' if way > 0 else '-'},"
                + ",".join(str(found[run, way].deviation_um) for run in numbers)
            )
    return Foreign("bare.csv", text(lines).encode())


@layout
def wide_without_a_cell() -> Foreign:
    passes = [(run, way) for run in range(1, RUNS + 1) for way in (1, -1)]
    head = ["Position [mm]", *(f"{run}{'↑' if way > 0 else '↓'} [µm]" for run, way in passes)]
    body = [";".join([str(t), *(str(by_pass(t)[one].deviation_um) for one in passes)]) for t in TARGETS]
    body[2] = body[2].rpartition(";")[0] + ";-"
    return Foreign("wide_hole.csv", text([";".join(head), *body]).encode(), missing=1)


@layout
def a_target_a_column() -> Foreign:
    head = ["Target [mm]", *map(str, TARGETS)]
    lines = [";".join(head)]
    for run in range(1, RUNS + 1):
        for way in (1, -1):
            name = f"{run} {'↑' if way > 0 else '↓'} [µm]"
            lines.append(";".join([name, *(str(by_pass(t)[run, way].deviation_um) for t in TARGETS)]))
    return Foreign("across.csv", text(lines).encode(), notes=("each row for a pass",))


listed(
    "zellen.csv",
    "Lauf;Richtung;Soll;Abweichung",
    lambda r: f"{r.run};{r.direction};{comma(r.target_mm, 1)} mm;{comma(r.deviation_um, 1)} µm",
    encoding="latin-1",
)
listed(
    "cells.txt",
    "Run\tDirection\tTarget [in]\tError [um]",
    lambda r: f"{r.run}\t{r.direction}\t{r.target_mm / 25.4:.8f}in\t{r.deviation_um}\u00a0µm",
)


@layout
def units_in_cells_of_two_kinds() -> Foreign:
    def length(r: Reading) -> str:
        return f"{r.deviation_um / 1000:.4f} mm" if r.run == 2 else f"{r.deviation_um} µm"

    body = rows(lambda r: f"{r.run};{r.direction};{r.target_mm} mm;{length(r)}")
    lines = text(["Run;Direction;Target;Error", *body])
    return Foreign("kinds.csv", lines.encode(), notes=("is in um and mm: all of it was turned into um",))


listed(
    "cellcontra.csv",
    "Run;Direction;Target [mm];Error [mm]",
    lambda r: f"{r.run};{r.direction};{r.target_mm};{r.deviation_um} µm",
    asks="states mm, and a cell of it um",
    maps=("Error [mm]=deviation_um",),
)
listed(
    "bareunit.csv",
    "Run;Direction;Target;Error",
    lambda r: f"{r.run};{r.direction};{r.target_mm} mm;{r.deviation_um}{' µm' if r.run > 1 else ''}",
    asks="has no unit; other cells have um",
    maps=("Error=deviation_um",),
)


@layout
def workbook_with_units_in_cells() -> Foreign:
    body: list[list[object]] = [[r.run, r.direction, f"{r.target_mm} mm", f"{r.deviation_um} µm"] for r in readings()]
    return Foreign("cells.xlsx", book({"X": [["Run", "Direction", "Target", "Error"], *body]}))


@layout
def wide_with_units_in_cells() -> Foreign:
    passes = [(run, way) for run in range(1, RUNS + 1) for way in (1, -1)]
    head = ["Position", *(f"{run}{'+' if way > 0 else '-'}" for run, way in passes)]
    body = [";".join([f"{t} mm", *(f"{by_pass(t)[one].deviation_um} um" for one in passes)]) for t in TARGETS]
    return Foreign("widecells.csv", text([";".join(head), *body]).encode())


def of_run(run: int) -> list[str]:
    return [f"{r.direction};{r.target_mm};{r.deviation_um}" for r in readings() if r.run == run]


def columns_of(way: int) -> list[str]:
    return [
        ";".join([str(t), *(str(by_pass(t)[run, way].deviation_um) for run in range(1, RUNS + 1))]) for t in TARGETS
    ]


@layout
def a_table_a_run() -> Foreign:
    lines: list[str] = []
    for run in range(1, RUNS + 1):
        lines += ["Direction;Target [mm];Error [um]", *of_run(run), ""]
    return Foreign("runs.csv", text(lines).encode(), notes=("took 3 tables for runs, in their order",))


@layout
def a_table_a_run_with_names() -> Foreign:
    lines = ["Positioning X", ""]
    for run in range(1, RUNS + 1):
        lines += [f"Run {run}", "Direction;Target [mm];Error [um]", *of_run(run), ""]
    return Foreign("named.csv", text(lines).encode(), notes=("'Run 1', 'Run 2', 'Run 3'",))


@layout
def names_of_runs_between_the_rows() -> Foreign:
    lines = ["Direction;Target [mm];Error [um]"]
    for run in range(1, RUNS + 1):
        lines += [f"Run {run}", *of_run(run)]
    return Foreign("between.csv", text(lines).encode(), notes=("'Run 1', 'Run 2', 'Run 3'",))


@layout
def forward_table_above_reverse_table() -> Foreign:
    lines: list[str] = []
    for way, name in ((1, "Forward"), (-1, "Reverse")):
        lines += [name, "Target [mm];Run 1 [um];Run 2 [um];Run 3 [um]", *columns_of(way), ""]
    return Foreign("stacked.csv", text(lines).encode(), notes=("'Forward', 'Reverse'",))


@layout
def forward_table_beside_reverse_table() -> Foreign:
    head = "Target [mm];Run 1 [um];Run 2 [um];Run 3 [um]"
    pairs = zip(columns_of(1), columns_of(-1), strict=True)
    lines = ["Forward;;;;;Reverse;;;", f"{head};;{head}", *(f"{one};;{other}" for one, other in pairs)]
    return Foreign("beside.csv", text(lines).encode(), notes=("'Forward', 'Reverse'",))


def of_axis(factor: float) -> list[str]:
    return rows(lambda r: f"{r.run};{r.direction};{r.target_mm};{factor * r.deviation_um:.1f}")


@layout
def two_axes_below_each_other() -> Foreign:
    head = "Run;Direction;Target [mm];Error [um]"
    lines = ["Axis: X", head, *of_axis(2), "", "Axis: Y", head, *of_axis(1)]
    return Foreign("axes.csv", text(lines).encode(), asks="--table 1", table=2)


@layout
def two_axes_with_numbers() -> Foreign:
    head = "Direction;Target [mm];Error [um]"
    one = [f"{r.direction};{r.target_mm};{r.deviation_um}" for r in readings()]
    other = [f"{r.direction};{r.target_mm};{2 * r.deviation_um:.1f}" for r in readings()]
    lines = ["Axis 1", head, *one, "", "Axis 2", head, *other]
    alone = tuple(replace(r, run=1) for r in readings())
    return Foreign("axis12.csv", text(lines).encode(), asks="'Axis 1', rows from line 3", table=1, expected=alone)


@layout
def two_axes_beside_each_other() -> Foreign:
    head = "Run;Direction;Target [mm];Error [um]"
    pairs = zip(of_axis(1), of_axis(2), strict=True)
    lines = ["X axis;;;;;Y axis;;;", f"{head};;{head}", *(f"{one};;{other}" for one, other in pairs)]
    return Foreign("axesbeside.csv", text(lines).encode(), asks="'Y axis'", table=1)


@layout
def headings_again_on_every_page() -> Foreign:
    head = "Run;Direction;Target [mm];Error [um]"
    lines: list[str] = []
    for number, line in enumerate(of_axis(1)):
        lines += [f"Page {number // 12 + 1}", head] if number % 12 == 0 else []
        lines.append(line)
    return Foreign("pages.csv", text(lines).encode(), notes=("with the same headings for one",))


@layout
def figures_below_the_readings() -> Foreign:
    head = "Run;Direction;Target [mm];Error [um]"
    figures = ["", "Target [mm];Mean up [um];Mean down [um];Sigma [um]", *(f"{t};1.2;2.2;0.3" for t in TARGETS)]
    lines = text([head, *of_axis(1), *figures])
    return Foreign("figures.csv", lines.encode(), notes=("not read, as it holds no readings",))


@layout
def contract_twice() -> Foreign:
    head = "run,direction,target_mm,deviation_um"
    body = [line.replace(";", ",") for line in of_axis(1)]
    return Foreign("twice.csv", text([head, *body, "", head, *body]).encode(), asks="--table 1", table=2)


@layout
def workbook_with_a_table_a_run() -> Foreign:
    lines: list[list[object]] = []
    for run in range(1, RUNS + 1):
        own = [[r.direction, r.target_mm, r.deviation_um] for r in readings() if r.run == run]
        lines += [[f"Run {run}"], ["Direction", "Target [mm]", "Error [µm]"], *own, []]
    return Foreign("runs.xlsx", book({"X": lines}), notes=("'Run 1', 'Run 2', 'Run 3'",))


@layout
def runs_beside_forward_and_reverse() -> Foreign:
    runs = range(1, RUNS + 1)
    body = [
        f"{run};{t};{by_pass(t)[run, 1].deviation_um};{by_pass(t)[run, -1].deviation_um}"
        for run in runs
        for t in TARGETS
    ]
    return Foreign("ways.csv", text(["Run;Position [mm];Forward [um];Reverse [um]", *body]).encode())


@layout
def thousands_with_points_alone() -> Foreign:
    """100.000 um and whole nanometres: a hundred with three decimals, or a hundred thousand; nobody can tell."""
    body = rows(lambda r: f"{r.run};{r.direction};{r.target_mm * 1000:,.0f};{r.deviation_um * 1000:.0f}")
    lines = text(["Run;Direction;Soll [µm];Abw [nm]", *body]).replace(",", ".")
    return Foreign("punkte.csv", lines.encode(), asks="or a point between thousands", decimal="comma")


listed("micro.csv", "Run;Direction;Target [mm];Error [µ]", plain(";"))
listed(
    "microinch.csv",
    "Run,Direction,Target (in),Error (µin)",
    lambda r: f"{r.run},{r.direction},{r.target_mm / 25.4:.10f},{r.deviation_um / 25.4e-3:.6f}",
)


@layout
def grouped_as_in_india() -> Foreign:
    def indian(value: float) -> str:
        whole = f"{value:,.1f}"
        return whole if value < 1e5 else f"{int(value // 1e5)},{int(value % 1e5 // 1e3):02d},{value % 1e3:05.1f}"

    body = rows(lambda r: f"{r.run}\t{r.direction}\t{indian(r.target_mm * 1000)}\t{r.deviation_um}")
    return Foreign("lakh.txt", text(["Run\tDirection\tNominal (um)\tError (um)", *body]).encode())


listed(
    "fortran.dat",
    "run direction target_m deviation_m",
    lambda r: f"{r.run} {r.direction} {r.target_mm / 1000:.6E} {r.deviation_um / 1e6:.6E}".replace("E", "D"),
)
listed(
    "sign.csv",
    "Run;Direction;Target [mm];Actual [mm];Error [um]",
    lambda r: f"{r.run};{r.direction};{r.target_mm};{r.actual_mm:.4f};{-r.deviation_um}",
    asks="is target less actual",
    maps=("Error [um]=ignore",),
)
listed(
    "comp.csv",
    "Run;Direction;Target [mm];Actual [mm];Error compensation [um]",
    lambda r: f"{r.run};{r.direction};{r.target_mm};{r.actual_mm:.4f};{-r.deviation_um}",
)


@layout
def merged_targets() -> Foreign:
    lines = []
    for target in TARGETS:
        for one in (r for r in readings() if r.target_mm == target):
            shown = target if (one.run, one.direction) == (1, 1) else ""
            lines.append(f"{shown};{one.run};{one.direction};{one.deviation_um}")
    expected = tuple(r for target in TARGETS for r in readings() if r.target_mm == target)
    text_ = text(["Target [mm];Run;Dir;Error [um]", *lines])
    return Foreign("merged.csv", text_.encode(), notes=("are taken for those above",), expected=expected)


@layout
def merged_headings() -> Foreign:
    lines: list[list[object]] = [["Deviation [µm]"], ["Target [mm]", "Forward", None, None, "Reverse", None, None]]
    lines.append([None, *range(1, RUNS + 1), *range(1, RUNS + 1)])
    passes = [(run, way) for way in (1, -1) for run in range(1, RUNS + 1)]
    lines += [[t, *(by_pass(t)[one].deviation_um for one in passes)] for t in TARGETS]
    return Foreign("mergedhead.xlsx", book({"X": lines}))


@layout
def another_axis_below_a_gap() -> Foreign:
    body = of_axis(1)
    lines = ["Run;Direction;Target [mm];Error [um]", *of_axis(2), "", "Y axis;;;", *body]
    return Foreign("gap.csv", text(lines).encode(), asks="'Y axis'", table=2)


@layout
def a_table_a_pass_with_dates() -> Foreign:
    lines = ["Machine: VMC 500", ""]
    for one in range(2 * RUNS):
        way, run = 1 - 2 * (one % 2), one // 2 + 1
        lines += [f"{'Forward' if way > 0 else 'Reverse'}", f"Date: 22.11.2026 10:1{one}", "Target [mm];Error [um]"]
        lines += [f"{r.target_mm};{r.deviation_um}" for r in readings() if (r.run, r.direction) == (run, way)]
        lines.append("")
    return Foreign("passes.csv", text(lines).encode(), notes=("took 6 tables for parts of one test",))


listed("nr.csv", "Nr.;Direction;Target [mm];Error [um]", plain(";"), notes=("'Nr.' for the number of the run",))
listed("savetxt.txt", "# run direction target_mm deviation_um", plain(" "))


@layout
def bars_and_rules() -> Foreign:
    body = rows(lambda r: f"| {r.run} | {r.direction} | {r.target_mm} | {r.deviation_um} |")
    lines = ["| Run | Direction | Target [mm] | Error [um] |", "|-----|-----|-----|-----|", *body]
    return Foreign("page.md", text(lines).encode())


@layout
def words_between_the_rows() -> Foreign:
    body = rows(lambda r: f"{r.run};{r.direction};{r.target_mm};{r.deviation_um}")
    body.insert(12, "door was opened")
    lines = text(["Run;Direction;Target [mm];Error [um]", *body])
    return Foreign("door.csv", lines.encode(), notes=("words between the rows are left out: line 14",))


@layout
def symbols_of_the_standard() -> Foreign:
    passes = [(run, way) for run in range(1, RUNS + 1) for way in (1, -1)]
    head = ["Pi [mm]", *(f"x{run}{'↑' if way > 0 else '↓'} [µm]" for run, way in passes)]
    body = [";".join([str(t), *(str(by_pass(t)[one].deviation_um) for one in passes)]) for t in TARGETS]
    return Foreign("symbols.csv", text([";".join(head), *body]).encode())


@layout
def labview() -> Foreign:
    head = ["LabVIEW Measurement\t", "Separator\tTab", "Decimal_Separator\t.", "***End_of_Header***\t", "\t"]
    head += ["Channels\t2\t", "Samples\t30\t30\t", "***End_of_Header***\t\t\t"]
    body = rows(lambda r: f"{r.time_s:.6f}\t{r.target_mm:.6f}\t{r.deviation_um:.6f}\t{r.run}\t{r.direction}\t")
    lines = [*head, "X_Value\tTarget (mm)\tError (um)\tRun\tDirection\tComment", *body]
    return Foreign("test.lvm", text(lines, "\r\n").encode())


@layout
def thesis_laser() -> Foreign:
    lines = ["Position       LasRead   LinearError Status AirTemp AirPress MatTemp"]
    for run in range(1, RUNS + 1):
        for one in (r for r in readings() if r.run == run):
            position, error = one.target_mm / 25.4, one.deviation_um / 25400
            lines.append(f"{position:12.5f} {-error - position:13.6f} {error:13.6f}      0 68.00 29.92    68.00")
    return Foreign("laser.dat", text(lines).encode())


def rtl() -> list[str]:
    lines = [
        "HEADER::",
        "File type  : rtl",
        "Owner      : Linear",
        "Version no : 20",
        "",
        "TARGET DATA::",
        "Filetype  : ISO",
    ]
    lines += [f"Target-count: {len(TARGETS)}", "Targets :"]
    lines += [
        " ".join(f"{t:12.6f}" for t in TARGETS[:3]),
        " ".join(f"{t:12.6f}" for t in TARGETS[3:]),
        "Flags: 0 0 2 0",
        "",
    ]
    lines += ["USER-TEXT::", "Machine: VMC 500", "Serial No: 17", "Date:2026-11-22 10:00:00", "Axis:X", "", "RUNS::"]
    lines += [f"Run-count:{2 * RUNS}", "", "DEVIATIONS::", "Run Target Data:"]
    for one in readings():
        number = 2 * one.run - (one.direction > 0)
        lines.append(f"{number:3d} {TARGETS.index(one.target_mm) + 1:4d} {one.deviation_um:12.6f}")
    return [*lines, "", "EOF::"]


@layout
def renishaw() -> Foreign:
    return Foreign("x.rtl", text(rtl(), "\r\n").encode(), notes=("laser file with sections",))


@layout
def renishaw_without_suffix() -> Foreign:
    return Foreign("export.txt", text(rtl()).encode("utf-16"), notes=("laser file with sections",))


@layout
def renishaw_targets_alone() -> Foreign:
    lines = rtl()
    return Foreign("x.pos", text(lines[: lines.index("RUNS::")]).encode(), asks="no deviations")


@layout
def laser_export_with_sections() -> Foreign:
    head = [
        "Machine: VMC 500",
        "Serial Number: 17",
        "Comments: X axis linear",
        "",
        "Raw Data:",
        "Target Position\tRun\tDirection\tError",
    ]
    body = rows(lambda r: f"{r.target_mm}\t{r.run}\t{'Forward' if r.direction > 0 else 'Reverse'}\t{r.deviation_um}")
    foot = ["", "Environmental Data:", "Air Temperature: 20.1", "Air Pressure: 1013.2"]
    return Foreign("export.asc", text([*head, "(mm)\t\t\t(um)", *body, *foot]).encode(), notes=("left out",))


def book(sheets: dict[str, list[list[object]]], hidden: Iterable[str] = ()) -> bytes:
    import openpyxl

    made = openpyxl.Workbook()
    made.remove(made.active)
    for title, lines in sheets.items():
        sheet = made.create_sheet(title)
        for line in lines:
            sheet.append(line)
        if title in hidden:
            sheet.sheet_state = "hidden"
    stream = io.BytesIO()
    made.save(stream)
    return stream.getvalue()


def sheet_rows() -> list[list[object]]:
    return [[r.run, "+" if r.direction > 0 else "-", r.target_mm, r.deviation_um] for r in readings()]


@layout
def workbook() -> Foreign:
    head: list[list[object]] = [["Run", "Direction", "Target [mm]", "Error [µm]"]]
    return Foreign("one.xlsx", book({"X axis": head + sheet_rows()}))


@layout
def workbook_with_titles() -> Foreign:
    head: list[list[object]] = [
        ["Positioning test"],
        ["Machine", "VMC 500"],
        [],
        [None, "Run", "Dir", "Soll", "Abw."],
        [None, "", "", "mm", "µm"],
    ]
    return Foreign(
        "titled.xlsx", book({"Data": head + [[None, *line] for line in sheet_rows()], "Notes": [["by A. Smith"]]})
    )


@layout
def workbook_of_several() -> Foreign:
    head: list[list[object]] = [["Run", "Direction", "Target [mm]", "Error [µm]"]]
    other = [[r, d, t, 2 * float(e)] for r, d, t, e in sheet_rows()]  # type: ignore[arg-type]  # numbers there
    sheets = {"before": head + other, "after": head + sheet_rows()}
    return Foreign("several.xlsx", book(sheets), asks="--sheet 'before'", sheet="After")


@layout
def workbook_with_formulas() -> Foreign:
    head: list[list[object]] = [["Run", "Direction", "Target [mm]", "Actual [mm]", "Error [µm]"]]
    body = [[r.run, r.direction, r.target_mm, r.actual_mm, f"=(D{n}-C{n})*1000"] for n, r in enumerate(readings(), 2)]
    return Foreign("formulas.xlsx", book({"X": head + body}), asks="E2 holds the formula")
