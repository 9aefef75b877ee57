"""Three axes on a bus, each corrected by where the others stand: measured on a grid, trained, and measured again."""

import numpy as np
import pytest
from grid_run import measure_grid
from volume import Slide, Volume, Waves, there_and_back

from rtec.axis.command import Move
from rtec.axis.encoder import Encoder
from rtec.dataset.load import load_dataset
from rtec.errors import ArgumentError
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.machine.cell import Cell
from rtec.machine.station_settings import StationSettings
from rtec.metrology import read_measurement, write_measurement
from rtec.predictors import AxisTables, NoError
from rtec.predictors.axis_tables import AxisTable
from rtec.predictors.fitting.several_axes import Geometry, fit_across
from rtec.requester.settings import PcState
from rtec.requester.supervision import HoldReason
from rtec.training.parts import samples_of

BEND = Waves(amplitudes=(0.008,), lengths_mm=(55.0,), phases_rad=(0.4,))
ROLL = Waves(amplitudes=(300e-6,), lengths_mm=(70.0,), phases_rad=(1.1,))
MACHINE = Volume(
    slides=(
        Slide(turns=(ROLL, ROLL, ROLL), backlash_mm=0.005),
        Slide(tilt_rad=(700e-6, 0.0, 0.0), shifts=(BEND, BEND, BEND)),
        Slide(tilt_rad=(0.0, -500e-6, 0.0), backlash_mm=0.003),
    )
)
"""A small machine with large errors: some 20 µm within 30 mm."""
REPEATABILITY_MM = 0.0004


def stations():
    box = InjectorSettings(design=Design.C, timing=Timing.of(Design.C, Processor.FAST), real_edges=RealEdges.HOLD)
    return [StationSettings(axis=axis, injector=box, encoder=Encoder(count_mm=0.0005)) for axis in (1, 2, 3)]


def measured(places, seed, **more):
    return measure_grid(stations(), MACHINE, places, rest_s=0.6, repeatability_mm=REPEATABILITY_MM, seed=seed, **more)


@pytest.fixture(scope="module")
def calibration():
    grid = np.linspace(-4.0, 34.0, 5)
    return measured(there_and_back(grid, grid, grid), 1)


def rms_um(readings):
    return 1e3 * np.sqrt(np.mean(readings.deviation_mm**2, axis=0))


def test_a_tracker_sees_the_machine_that_is_there(calibration):
    """But for the repeatability, the error of the machine at the target, and up to half a count of standstill."""
    shown = calibration.deviation_mm - MACHINE.error_mm(calibration.target_mm, calibration.direction)
    assert calibration.target_mm.shape == (250, 3)
    assert np.std(shown) == pytest.approx(np.hypot(REPEATABILITY_MM, 0.0005 / np.sqrt(12.0)), rel=0.25)
    assert np.abs(shown.mean(axis=0)).max() < 2e-4
    assert {*calibration.direction[:, 0]} == {*calibration.direction[:, 2]} == {1.0, -1.0}


@pytest.mark.parametrize("geometry", [Geometry.SQUARENESS, Geometry.ANGLES])
def test_each_axis_is_corrected_by_where_the_others_stand(calibration, tmp_path, geometry):
    predictors = []
    for axis in (1, 2, 3):
        file = tmp_path / f"{axis}.csv"
        write_measurement(file, calibration.of_axis(axis))
        predictors.append(fit_across(samples_of(load_dataset(file))[0], geometry).predictor)
    places = there_and_back([3.0, 16.0, 28.0], [5.0, 27.0], [4.0, 15.0])
    before, after = measured(places, 2), measured(places, 2, predictor=predictors)
    assert not after.held
    assert all(axis.pc_state is PcState.ACTIVE and axis.off_counts == 0 for axis in after.outcomes)
    assert rms_um(before).min() > 4.0
    if geometry is Geometry.ANGLES:  # a step of 1 µm and a reading leave 0.5 µm; five points a table the rest
        assert rms_um(after).max() < 1.2
    else:  # what bends and turns is still there
        assert 2.0 < rms_um(after).max() < 0.8 * rms_um(before).max()


def test_the_readings_of_an_axis_go_through_a_file(calibration, tmp_path):
    file = tmp_path / "2.csv"
    write_measurement(file, calibration.of_axis(2))
    assert read_measurement(file).facts["axis"] == "2"
    samples, _ = samples_of(load_dataset(file))
    assert list(samples.others_mm) == [1, 3]
    assert samples.error_mm == pytest.approx(calibration.deviation_mm[:, 1])
    with pytest.raises(ArgumentError, match="axis: 4"):
        calibration.of_axis(4)


def leaning(low, high):
    own = AxisTable(of="position", positions_mm=[-50.0, 50.0], values=[0.0, 0.0])
    square = AxisTable(of="position_2", positions_mm=[low, high], values=[1e-3 * low, 1e-3 * high])
    return AxisTables(tables=(own, square), range_mm=(-50.0, 50.0))


def test_where_another_axis_was_never_measured_the_machine_is_held():
    lines = [Move(target_mm=(5.0, 12.0, 0.0), speed_mm_s=20.0, rest_s=0.5)]
    inside = Cell(stations(), lines, [leaning(0.0, 15.0), NoError(), NoError()])
    beyond = Cell(stations(), lines, [leaning(0.0, 6.0), NoError(), NoError()])
    for cell in (inside, beyond):
        cell.run(until_ps=2 * 10**12)
    assert inside.held_ps is None
    assert inside.axes[0].target_steps == 12  # 12 µm by steps of 1 µm
    assert [axis.target_steps for axis in inside.axes[1:]] == [0, 0]
    assert beyond.held_ps is not None
    assert beyond.axes[0].pc_reason is HoldReason.PREDICTOR_OUT_OF_RANGE


def test_what_does_not_fit_is_refused():
    line = [Move(target_mm=(1.0, 1.0, 1.0), speed_mm_s=20.0)]
    with pytest.raises(ArgumentError, match="2 models"):
        Cell(stations(), line, [NoError(), NoError()])
    with pytest.raises(ArgumentError, match="model of axis 2"):
        Cell(stations(), line, leaning(0.0, 5.0))
    with pytest.raises(ArgumentError, match="stations"):
        measure_grid(stations()[:2], MACHINE, [(0.0, 0.0)])
    with pytest.raises(ArgumentError, match="places_mm"):
        measure_grid(stations(), MACHINE, [])
    with pytest.raises(ArgumentError, match="places_mm: a place of 2 axes"):
        measure_grid(stations(), MACHINE, [(0.0, 0.0)])
    with pytest.raises(ArgumentError, match="runs"):
        measure_grid(stations(), MACHINE, [(0.0, 0.0, 0.0)], runs=0)
