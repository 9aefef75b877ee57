"""The feed along a path: limits kept between all samples, near the shortest time, and what it says of itself."""

import numpy as np
import pytest
from arc_length_paths import Arcs, Spline, butterfly, circle, joined, line, random_spline
from scipy.interpolate import BSpline

from rtec.errors import ArgumentError
from rtec.toolpath.feed import FeedLimits, audit, audit_positions, plan_feed

LINEAR_MOTOR = {"velocity_mm_s": 2500.0, "acceleration_mm_s2": 25_000.0, "jerk_mm_s3": 500_000.0}
LIMITS = FeedLimits(**LINEAR_MOTOR)
NEAR_CUSP = np.array([[0, 0], [40, 30], [60, 0.0], [20, 0.004], [40, -30.0], [90, -20], [120, 10]])
QUARTER = (np.pi / 2 * 5.0, 0.2)


class Cusp:
    """The curve (u^2, u^3) from u = -1 to 1: its curvature has no bound where it turns back."""

    closed = False

    def __init__(self, knot=True):
        self.half = float(self._length(1.0))
        self.length_mm = 2.0 * self.half
        self.knots_mm = np.array([0.0, *([self.half] if knot else []), self.length_mm])

    @staticmethod
    def _length(u):
        return ((4.0 + 9.0 * u**2) ** 1.5 - 8.0) / 27.0

    def _u(self, s):
        d = np.asarray(s, float) - self.half
        w = np.cbrt(27.0 * abs(d) + 8.0) ** 2 - 4.0
        return np.sign(d) * np.sqrt(np.maximum(w, 0.0)) / 3.0

    def points(self, s_mm):
        u = self._u(s_mm)
        return np.stack([u**2, u**3], axis=1)

    def derivatives(self, s_mm, side=1):
        u = self._u(s_mm)
        e, g = np.where(u == 0.0, side, np.sign(u)), np.sqrt(4.0 + 9.0 * u**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = 6.0 / (abs(u) * g**3)  # of the tangent (2, 3 u) / g, by arc length
            slope = -e * (6.0 / (u**2 * g**3) + 162.0 / g**5) / (abs(u) * g)
        t, n = np.stack([2.0 * e, 3.0 * u * e], 1) / g[:, None], np.stack([-3.0 * u * e, 2.0 * e], 1) / g[:, None]
        k = turn[:, None]
        return t, k * n, slope[:, None] * n - k**2 * t


def near_cusp():
    knots = np.concatenate(([0.0] * 4, [0.3, 0.5, 0.7], [1.0] * 4))
    return Spline(BSpline(knots, NEAR_CUSP, 3))


def differentiated(plan, limits):
    """Largest share of the limits by differences of the positions alone; an average never exceeds what it is of."""
    size = abs(plan.path.points(np.linspace(0.0, plan.path.length_mm, 200))).max()
    step = max(3.0 * np.cbrt(1e-8 * size / np.min(limits.jerk_mm_s3)), plan.time_s / 40_000)
    x = plan.positions(np.arange(-4.0 * step, plan.time_s + 4.0 * step, step))
    tops = limits.velocity_mm_s, limits.acceleration_mm_s2, limits.jerk_mm_s3
    return [abs(np.diff(x, i, axis=0) / step**i / top).max() for i, top in enumerate(tops, start=1)]


PATHS = {
    "butterfly": butterfly,
    "circle": lambda: circle(100.0),
    "random": lambda: random_spline(1),
    "random in space": lambda: random_spline(9, axes=3),
    "near a cusp": near_cusp,
    "cusp": Cusp,
    "square with round corners": lambda: Arcs([(100.0, 0.0), QUARTER] * 4, closed=True),
    "corners and reversal": lambda: Arcs([(100.0, 0.0), (50.0, 0.0), (0.01, 0.0)], turns=[0.0, 1.0, np.pi]),
    "splines with corners": lambda: joined([random_spline(1), line(30.0), random_spline(2)]),
}


@pytest.mark.parametrize("name", PATHS)
def test_no_limit_is_exceeded_anywhere_and_one_binds_nearly_everywhere(name):
    path = PATHS[name]()
    plan = plan_feed(path, LIMITS)
    shares = differentiated(plan, LIMITS)
    assert max(shares) <= 1.0 + 1e-6
    assert max(shares) > 0.99
    assert plan.audit.passed, str(plan.audit)
    used = plan.limit_at(np.linspace(0.0, path.length_mm, 1001))[1]
    assert used.mean() > 0.95


@pytest.mark.parametrize("name", ["butterfly", "splines with corners"])
def test_feed_acceleration_and_jerk_are_derivatives_of_the_way(name):
    plan = plan_feed(PATHS[name](), LIMITS)
    t = np.linspace(0.0, plan.time_s, 200_001)
    s, v, a, j = plan.at(t)
    assert (s[0], v[0], v[-1]) == (0.0, 0.0, 0.0)
    assert s[-1] == pytest.approx(plan.path.length_mm, abs=1e-9)
    for rate, value, top in ((v, s, 3500.0), (a, v, 35_000.0), (j, a, 1e6)):
        change = np.concatenate(([0.0], np.cumsum((rate[1:] + rate[:-1]) / 2.0 * np.diff(t))))
        assert abs(change - (value - value[0])).max() < 1e-3 * top * plan.time_s


def test_a_straight_line_takes_the_time_of_the_closed_form():
    # both ramps of the acceleration, the way at full acceleration, and the rest at full speed
    plan = plan_feed(line(1000.0), LIMITS)
    assert 0.55 <= plan.time_s < 0.55 * 1.006
    assert plan.time_without_jerk_limit_s == pytest.approx(0.5, rel=1e-3)
    # so short that the jerk alone limits: four pieces of constant jerk
    short = plan_feed(line(0.01), LIMITS)
    exact = np.cbrt(32.0 * 0.01 / 500_000.0)
    assert exact <= short.time_s < 1.02 * exact


def test_the_price_of_the_jerk_limit_on_the_butterfly():
    plan = plan_feed(butterfly(), LIMITS)
    assert 0.02 < plan.price < 0.09
    assert f"{100.0 * plan.price:.1f} % longer than without a limit of jerk" in str(plan)
    # almost no limit of jerk: almost no price
    free = plan_feed(butterfly(), FeedLimits(**LINEAR_MOTOR | {"jerk_mm_s3": 1e9}))
    assert free.time_s == pytest.approx(free.time_without_jerk_limit_s, rel=0.01)
    assert free.time_without_jerk_limit_s == pytest.approx(plan.time_without_jerk_limit_s, rel=0.005)


def test_the_feed_stops_where_direction_or_curvature_jumps_and_nowhere_else():
    path = PATHS["square with round corners"]()
    plan = plan_feed(path, LIMITS)
    assert plan.stops_mm.tolist() == path.knots_mm.tolist()
    assert plan.time_without_jerk_limit_s < 0.6 * plan.time_s
    assert plan_feed(random_spline(1), LIMITS).stops_mm.size == 2


def test_each_axis_has_limits_of_its_own_and_the_plan_names_the_one_that_binds():
    limits = FeedLimits(velocity_mm_s=(2500.0, 200.0), acceleration_mm_s2=25_000.0, jerk_mm_s3=(5e5, 1e6))
    plan = plan_feed(line(2000.0, (0.6, 0.8)), limits)
    names, used = plan.limit_at([1e-3, 1000.0])
    assert names.tolist() == ["jerk of axis 0", "velocity of axis 1"]
    assert used == pytest.approx([1.0, 1.0], abs=0.02)
    assert abs(plan.axis_motion(plan.time_s / 2)[0][0]) == pytest.approx([150.0, 200.0], rel=1e-3)


@pytest.mark.parametrize("kind", ["rows", "function"])
def test_the_feed_is_lowered_where_the_caller_wants(kind):
    path = circle(100.0)
    rows = np.array([[0.0, 5000.0], [200.0, 5000.0], [210.0, 300.0], [260.0, 300.0], [270.0, 5000.0]])
    feed = rows if kind == "rows" else lambda s: np.interp(s, *rows.T)
    plan = plan_feed(path, FeedLimits(**LINEAR_MOTOR, feed_mm_s=feed))
    s, v, *_ = plan.at(np.linspace(0.0, plan.time_s, 100_001))
    assert (v / np.interp(s, *rows.T)).max() <= 1.0 + 1e-6
    assert v[(s > 225.0) & (s < 240.0)].min() > 299.0
    assert "feed" in plan.limit_at([235.0])[0]
    assert plan.time_s > plan_feed(path, LIMITS).time_s


def test_an_audit_against_lower_limits_and_along_another_path_fails():
    plan = plan_feed(circle(100.0), LIMITS)
    lower = audit(plan.path, plan, FeedLimits(**LINEAR_MOTOR | {"jerk_mm_s3": 499_990.0}))
    assert not lower.passed
    assert lower.worst.kind == "jerk"
    assert lower.worst.share == pytest.approx(500_000.0 / 499_990.0, abs=2e-7)
    corner = Arcs([(300.0, 0.01), (plan.path.length_mm - 300.0, 0.01)], turns=[0.0, 0.01])
    assert audit(corner, plan, LIMITS).worst.share == np.inf


def test_positions_of_others_are_audited_and_rounding_is_not_held_against_them():
    plan = plan_feed(butterfly(), LIMITS)
    t = np.arange(0.0, plan.time_s, 2.5e-4)
    rounded = np.round(plan.positions(t), 5)
    assert not audit_positions(t, rounded, LIMITS).passed
    assert audit_positions(t, rounded, LIMITS, resolution_mm=1e-5).passed
    fast = audit_positions(0.99 * t, plan.positions(t), LIMITS)
    assert fast.worst.kind == "jerk"
    assert fast.worst.share == pytest.approx(0.99**-3, rel=0.01)


@pytest.mark.parametrize("name", LINEAR_MOTOR)
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, (1.0, 0.0), "fast", ()])
def test_a_limit_that_is_not_above_zero_is_refused(name, value):
    with pytest.raises(ArgumentError, match=f"^{name}: .* finite numbers above 0"):
        FeedLimits(**LINEAR_MOTOR | {name: value})


@pytest.mark.parametrize("feed", [0.0, np.nan, [[0.0, 1.0], [1.0, -1.0]], [[1.0, 1.0], [1.0, 2.0]], [1.0, 2.0]])
def test_a_feed_that_is_not_above_zero_is_refused(feed):
    with pytest.raises(ArgumentError, match=r"^feed_mm_s: "):
        FeedLimits(**LINEAR_MOTOR, feed_mm_s=feed)


def test_what_cannot_be_planned_is_refused_with_one_sentence():
    with pytest.raises(ArgumentError, match="path: a length of 0 mm; use a path with a length above 0 mm"):
        plan_feed(Arcs([(0.0, 0.0)]), LIMITS)
    with pytest.raises(ArgumentError, match="velocity_mm_s: an array of 3 numbers; use one, or 2: one per axis"):
        plan_feed(circle(1.0), FeedLimits(**LINEAR_MOTOR | {"velocity_mm_s": (1.0, 2.0, 3.0)}))
    with pytest.raises(ArgumentError, match="feed_mm_s: a function"):
        plan_feed(circle(1.0), FeedLimits(**LINEAR_MOTOR, feed_mm_s=lambda s: 1.0 - s))
    with pytest.raises(ArgumentError, match=r"path: a corner or cusp at s = 1\.43971 mm that is not"):
        plan_feed(Cusp(knot=False), LIMITS)
    with pytest.raises(ArgumentError, match="t_s: "):
        audit_positions([0.0, 1.0, 1.0, 2.0], np.zeros(4), LIMITS)


@pytest.mark.sweep
@pytest.mark.parametrize("seed", range(200))
def test_no_limit_is_exceeded_on_random_paths_with_random_limits(seed):
    random = np.random.default_rng(seed)
    axes = 2 + seed % 2
    path = random_spline(seed, int(random.integers(5, 40)), 10.0 ** random.uniform(0.0, 3.0), axes)
    if seed % 7 == 0:
        path = joined([path, random_spline(seed + 1000, 8, 10.0 ** random.uniform(-1.0, 2.5), axes)])
    each = axes if seed % 3 == 0 else None
    low_high = ((1.5, 3.5), (2.5, 4.5), (4.0, 6.5))
    tops = [10.0 ** random.uniform(low, high, each) for low, high in low_high]
    limits = FeedLimits(**dict(zip(LINEAR_MOTOR, tops, strict=True)))
    plan = plan_feed(path, limits)
    assert plan.audit.passed, str(plan.audit)
    assert max(differentiated(plan, limits)) <= 1.0 + 1e-6
    assert plan.limit_at(np.linspace(0.0, path.length_mm, 1001))[1].mean() > 0.9
