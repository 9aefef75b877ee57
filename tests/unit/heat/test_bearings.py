"""Heat and where it goes, against published formulas and figures."""

import pytest

from rtec.errors import ArgumentError
from rtec.heat import Bearing, Duty, Link, Loss, Network, Node, Oil, Piece, jacket_w_m2_k, rotating_w_m2_k


def test_a_bearing_gives_the_heat_of_palmgren():
    """dm 60 mm and 20 mm2/s; the speeds span the change of the formula at nu n = 2000."""
    bearing = Bearing(name="b", inner="a", outer="c", mean_diameter_mm=60.0, f0=2.0, f1=0.00035)
    rpms = (1250, 2500, 5000, 10_000, 20_000)
    assert [round(bearing.heat_w(rpm, viscosity_mm2_s=20.0)) for rpm in rpms] == [5, 16, 51, 159, 500]
    below, above = (bearing.moments_nmm(rpm, viscosity_mm2_s=20.0)[0] for rpm in (99.9, 100.1))
    assert below == pytest.approx(160e-7 * 2.0 * 60.0**3)
    assert above == pytest.approx(below, rel=0.01)


@pytest.mark.parametrize(("rpm", "outer_degc"), [(50.0, 44.0), (3000.0, 44.0), (3000.0, 80.0)])
def test_a_network_takes_the_heat_that_a_bearing_and_a_loss_say(rpm, outer_degc):
    """With the outer ring at 80 degC the preload is gone."""
    oil = Oil(at_40_mm2_s=22.0, at_100_mm2_s=4.3)
    bearing = Bearing(
        name="b",
        inner="a",
        outer="c",
        mean_diameter_mm=80.0,
        preload_n=150.0,
        preload_n_k=20.0,
        force_share=0.5,
        oil=oil,
    )
    loss = Loss(name="m", node="a", per_speed_w=0.02, per_speed2_w=1e-5, force2_w=1e-3, oil=oil)
    nodes = (Node(name="a", capacity_j_k=500.0), Node(name="c", capacity_j_k=500.0))
    network = Network(nodes=nodes, links=(Link(a="a", b="c"),), bearings=(bearing,), losses=(loss,))
    duty = Duty((Piece(duration_s=1.0, spindle_rpm=rpm, force_n=100.0),))
    powers = network.run(duty, start_degc={"a": 50.0, "c": outer_degc}).heat_w[0]
    load_n = max(150.0 + 20.0 * (50.0 - outer_degc), 0.0) + 0.5 * 100.0
    nu = oil.viscosity_mm2_s(0.5 * (50.0 + outer_degc))
    assert powers[0] == pytest.approx(bearing.heat_w(rpm, viscosity_mm2_s=nu, load_n=load_n))
    assert powers[1] == pytest.approx(loss.heat_w(rpm, 50.0, 100.0))


@pytest.mark.parametrize(
    ("at_40", "at_100", "at_20"),
    [(32.0, 5.4, 87.0), (46.0, 6.8, 135.0), (68.0, 8.7, 217.0), (100.0, 11.2, 343.0)],
)
def test_the_viscosity_of_an_oil_follows_its_class(at_40, at_100, at_20):
    oil = Oil(at_40_mm2_s=at_40, at_100_mm2_s=at_100)
    assert oil.viscosity_mm2_s(40.0) == pytest.approx(at_40)
    assert oil.viscosity_mm2_s(100.0) == pytest.approx(at_100)
    assert oil.viscosity_mm2_s(20.0) == pytest.approx(at_20, rel=0.05)


def test_viscosities_between_are_those_that_others_compute():
    """ASTM D341 through 32 and 5.4 mm2/s, as a calculator of another hand prints it (scribd 361017004): 8.5 at 80."""
    assert Oil().viscosity_mm2_s(80.0) == pytest.approx(8.5, abs=0.05)


def test_convection_of_rotating_parts_and_jackets():
    """A cylinder of 100 mm at 3000 rev/min: Re = 15.708 m/s 0.1 m / 15.7e-6 m2/s = 1.0005e5, Nu = 255.7."""
    assert rotating_w_m2_k(100.0, 3000.0) == pytest.approx(255.7 * 0.026 / 0.1, rel=1e-3)
    assert rotating_w_m2_k(100.0, 8000.0) == pytest.approx(4.0 * rotating_w_m2_k(100.0, 1000.0))
    assert jacket_w_m2_k(10.0, 16.0) == pytest.approx(2.0**0.8 * jacket_w_m2_k(10.0, 8.0))
    with pytest.raises(ArgumentError, match=r"flow_l_min: 1.0 is not turbulent; use more flow .*Re is 2122"):
        jacket_w_m2_k(10.0, 1.0)


def test_what_cannot_be_is_refused():
    with pytest.raises(ArgumentError, match=r"at_100_mm2_s: 40.0 is not valid; use less than the 32 at 40 degC"):
        Oil(at_40_mm2_s=32.0, at_100_mm2_s=40.0)
    with pytest.raises(ArgumentError, match="bearing b: mean_diameter_mm: 0 mm is too small; use 1 to 2000 mm"):
        Bearing(name="b", inner="a", outer="c", mean_diameter_mm=0.0)
    with pytest.raises(ArgumentError, match="loss m: share: 2 is too large; use 0 to 1"):
        Loss(name="m", node="a", share=2.0)
