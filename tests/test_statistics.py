import numpy as np
import pytest
from scipy.stats import binom

from er_il.evaluation.statistics import exact_interval, paired_difference
from er_il.support.errors import ErIlError


# The paper's cells with n = 10, as percentages.
@pytest.mark.parametrize(
    ("successes", "low", "high"), [(10, 69.2, 100), (9, 55.5, 99.7), (4, 12.2, 73.8), (0, 0, 30.8)]
)
def test_exact_intervals_of_ten_episodes(successes: int, low: float, high: float):
    assert 100 * np.array(exact_interval(successes, 10)) == pytest.approx([low, high], abs=0.06)


@pytest.mark.parametrize("rate", [0.02, 0.3, 0.9, 0.99])
def test_exact_intervals_cover_at_least_as_often_as_they_say(rate: float):
    n = 50
    hits = [lo <= rate <= hi for lo, hi in (exact_interval(k, n) for k in range(n + 1))]
    assert binom.pmf(np.arange(n + 1), n, rate)[hits].sum() >= 0.95


def test_paired_difference_sees_more_than_two_separate_intervals():
    a = [True] * 40 + [False] * 10
    b = [True] * 33 + [False] * 17  # fails wherever a does, and seven times more
    difference, low, high = paired_difference(a, b)
    assert difference == pytest.approx(0.14)
    assert 0 < low < difference < high
    assert exact_interval(40, 50)[0] < exact_interval(33, 50)[1]  # the separate ones overlap


def test_paired_difference_is_antisymmetric_and_covers():
    rng = np.random.default_rng(0)
    covered = 0
    for _ in range(400):
        kind = rng.choice(4, size=60, p=[0.6, 0.2, 0.05, 0.15])  # both, a only, b only, neither
        a, b = (kind <= 1).tolist(), np.isin(kind, [0, 2]).tolist()
        difference, low, high = paired_difference(a, b)
        assert paired_difference(b, a) == pytest.approx((-difference, -high, -low))
        covered += low <= 0.15 <= high
    assert covered / 400 > 0.93


def test_nothing_has_no_rate():
    for mistake in [lambda: exact_interval(0, 0), lambda: exact_interval(3, 2)]:
        with pytest.raises(ErIlError, match="no rate"):
            mistake()
    with pytest.raises(ErIlError, match="paired"):
        paired_difference([True], [True, False])
