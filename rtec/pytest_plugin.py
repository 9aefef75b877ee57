"""Fixtures for the tests of a PC program: a box with its axis on a simulated bus, and faults between them.

The plugin loads with pytest wherever rtec is installed; what it needs is imported when a test asks for a fixture.
`docs/how-to-test-your-pc.md` shows it at work.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from rtec.link.simulated_can import SimulatedCan
    from rtec.machine.bench_faults import BenchFaults
    from rtec.machine.workbench import BenchBox, Workbench

MARKER = "rtec"


def pytest_configure(config: pytest.Config) -> None:
    """Make the marker known."""
    config.addinivalue_line(
        "markers",
        "rtec(design='original', count_um=1.0, window_steps=3, grace_readings=2, watchdog_ms=50, axes=1, "
        "bitrate=500000, requirement=''): what box the fixtures rtec_box, rtec_bus and rtec_faults are about, and "
        "what the test is evidence for",
    )
    file = config.getoption("--rtec-csv")
    if file and not hasattr(config, "workerinput"):  # with xdist the first process has the reports of all
        config.pluginmanager.register(_Records(file), "rtec-records")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option for records."""
    parser.getgroup("rtec").addoption(
        "--rtec-csv", metavar="FILE.csv", help="write a record of each test with faults, in the columns of a campaign"
    )


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Give a test with faults, or one that asks for ``rtec_record``, its record as properties of its report."""
    report = yield
    fixtures = getattr(item, "funcargs", {})
    own, faults = fixtures.get("rtec_record"), fixtures.get("rtec_faults")
    if call.when == "call" and (own is not None or (faults is not None and faults.activations)):
        from rtec.verify.campaign.bench_trial import bench_columns, trial_row  # noqa: PLC0415 - as below

        columns = {} if faults is None else bench_columns(fixtures["rtec_bench"], faults.activations)
        marks = [mark.kwargs["requirement"] for mark in item.iter_markers(MARKER) if "requirement" in mark.kwargs]
        columns |= {"requirement": " ".join(dict.fromkeys(marks))} | (own or {})
        row = trial_row(item.nodeid, passed=report.passed, seconds=call.duration, own=columns)
        item.user_properties += [(name, value) for name, value in row.items() if value not in (None, "")]
    return report


class _Records:
    """Collects the records of all tests, those of other processes too, and writes them."""

    def __init__(self, file: str) -> None:
        self._file, self._rows = file, list[dict[str, object]]()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        row = dict(report.user_properties)
        if report.when == "teardown" and row.get("plan") == "pytest":
            self._rows.append(row)

    def pytest_sessionfinish(self) -> None:
        from pathlib import Path  # noqa: PLC0415 - as below

        from rtec.verify.campaign.export import write_rows  # noqa: PLC0415 - as below

        write_rows(Path(self._file), lambda: iter(self._rows))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, Any, Any]:
    """Fail a test whose armed faults took no effect: it has shown nothing."""
    outcome = yield
    faults = getattr(item, "funcargs", {}).get("rtec_faults")
    if faults is not None and faults.unfired:
        pytest.fail(
            f"armed, but without effect: {'; '.join(faults.unfired)}. Let the test run longer or drive what the "
            "fault has an effect; arm it with must_fire=False where that is no failure.",
            pytrace=False,
        )
    return outcome


@pytest.fixture
def rtec_bench(request: pytest.FixtureRequest) -> Workbench:
    """Boxes with their axes on a simulated bus: ``boxes[axis]`` and ``bus``; the marker ``rtec`` says which."""
    from rtec.errors import ArgumentError, nearest  # noqa: PLC0415 - pytest loads this file in every project
    from rtec.machine.workbench import bench_of  # noqa: PLC0415 - for tests that ask for it

    options = _options(request)
    known = list(bench_of.__kwdefaults__ or {})
    for name in options:
        if name not in known:
            pytest.fail(f"the marker rtec has no option {name!r}; {nearest(str(name), known)}", pytrace=False)
    try:
        return bench_of(**options)
    except ArgumentError as error:
        pytest.fail(f"the marker rtec: {error}", pytrace=False)


@pytest.fixture
def rtec_box(rtec_bench: Workbench) -> BenchBox:
    """Return the box of axis 1, switched on at its home, homed by nobody yet."""
    return rtec_bench.boxes[1]


@pytest.fixture
def rtec_bus(rtec_bench: Workbench) -> Iterator[SimulatedCan]:
    """Return a python-can bus for the PC program, node 0 of the simulated bus."""
    from rtec.link.simulated_can import SimulatedCan  # noqa: PLC0415 - as above

    with SimulatedCan(rtec_bench.bus) as bus:
        yield bus


@pytest.fixture
def rtec_faults(rtec_bench: Workbench, rtec_bus: SimulatedCan) -> BenchFaults:
    """Return what arms faults; the test fails where one takes no effect."""
    from rtec.machine.bench_faults import BenchFaults  # noqa: PLC0415 - as above

    return BenchFaults(rtec_bench, rtec_bus.clock.jump)


@pytest.fixture
def rtec_record() -> dict[str, Any]:
    """Return a dictionary: what a test puts in becomes columns of its record."""
    return {}


def _options(request: pytest.FixtureRequest) -> dict[str, Any]:
    """Return the options of the markers, the nearest last, and of a parametrised ``rtec_box``."""
    options: dict[str, Any] = {}
    for marker in reversed(list(request.node.iter_markers(MARKER))):
        if marker.args:
            pytest.fail(f"the marker rtec takes options by name, found {marker.args!r}", pytrace=False)
        options.update((name, value) for name, value in marker.kwargs.items() if name != "requirement")
    callspec = getattr(request.node, "callspec", None)
    parameter = {} if callspec is None else callspec.params.get("rtec_box", {})
    if not isinstance(parameter, dict):
        pytest.fail(f"rtec_box takes a dictionary of options, found {parameter!r}", pytrace=False)
    return options | parameter
