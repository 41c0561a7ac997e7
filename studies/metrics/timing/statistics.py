"""Statistics of frame times: percentiles, missed deadlines, ratios with their spread."""

from dataclasses import dataclass

import numpy as np
from scipy.special import bdtr

from studies.base.errors import StudyError

DEADLINES_MS = (1.0, 2.0, 25.0, 33.0)
"""Haptics at 1 kHz and 500 Hz, the paper's 40 frames/s, video at 30 frames/s."""
DISTURBED = 0.1
"""Share of the wall time of a repeat in which the program did not run, and share of the machine's processors that other
processes took, above which a timing is disturbed: who uses its core makes it wait, who uses others slows clock, cache
and memory."""
CONFIDENCE = 0.9  # five repeats give 0.9375; fewer than five cannot resolve anything


def percentiles(frame_ns: np.ndarray) -> dict[str, float]:
    """p50, p95, p99 and max of all frames of all repeats [ns]; frame_ns of any shape.

    Percentiles are not interpolated: each is the time of a measured frame.
    """
    p50, p95, p99 = np.percentile(frame_ns, [50, 95, 99], method="higher")
    return {"p50": float(p50), "p95": float(p95), "p99": float(p99), "max": float(np.max(frame_ns))}


def disturbance(frame_ns: np.ndarray, cpu_ns: np.ndarray | None, others: float | None) -> str:
    """Why frame times are not those of the program alone, in words; empty where nothing says so.

    frame_ns, cpu_ns: wall and processor time (repeat, F) [ns]; others: share of the machine's processors that other
    processes took, 0 to 1. None: unknown.
    """
    waited = 0.0 if cpu_ns is None else float(np.max(1.0 - cpu_ns.sum(axis=1) / frame_ns.sum(axis=1)))
    shares = {
        f"the program waited {100 * waited:.0f} % of a repeat": waited,
        f"other processes took {100 * (others or 0.0):.0f} % of the processors": others or 0.0,
    }
    return ", ".join(words for words, share in shares.items() if share > DISTURBED)


def missed(frame_ns: np.ndarray, deadlines_ms: tuple[float, ...] = DEADLINES_MS) -> dict[float, float]:
    """Deadline [ms] -> share of frames, 0 to 1, that took longer; frame_ns [ns] of any shape."""
    frame_ns = np.asarray(frame_ns)
    return {deadline: float(np.mean(frame_ns > 1e6 * deadline)) for deadline in deadlines_ms}


def kernel_ns(frame_ns: np.ndarray) -> float:
    """Time of a frame without disturbance [ns]: the median over frames of the fastest repeat of each.

    frame_ns: (repeat, F); every repeat computes the same frames.
    """
    return float(np.median(np.min(frame_ns, axis=0)))


@dataclass(frozen=True)
class Ratio:
    """A ratio of times with its interval; `confidence` is the chance that the interval holds the true median."""

    median: float
    low: float
    high: float
    confidence: float

    @property
    def resolvable(self) -> bool:
        return self.confidence >= CONFIDENCE and not self.low <= 1.0 <= self.high

    def __str__(self) -> str:
        interval = f"{self.low:.3g} to {self.high:.3g}"
        return f"{self.median:.3g} ({interval})" if self.resolvable else f"not resolvable ({interval})"


def ratio_with_spread(a: np.ndarray, b: np.ndarray) -> Ratio:
    """Ratio of the frame time of `a` to that of `b`; both (repeat, F) [ns], measured in turn.

    Each repeat gives the ratio of the median frames of one round, so that a slow phase of the machine, which affects
    both, cancels. The result is their median; its interval is that of the sign test: between the k-th smallest and the
    k-th largest ratio, without assumptions on the distribution (Conover, Practical Nonparametric Statistics, ch. 3.2).
    Raises StudyError when the repeats cannot be paired.
    """
    a, b = np.atleast_2d(a), np.atleast_2d(b)
    if len(a) != len(b):
        raise StudyError(
            f"a ratio pairs the repeats of both, but there are {len(a)} and {len(b)}: measure them in turns"
        )
    ratios = np.sort(np.median(a, axis=1) / np.median(b, axis=1))
    rank, confidence = _sign_test_rank(len(ratios))
    return Ratio(float(np.median(ratios)), float(ratios[rank - 1]), float(ratios[-rank]), confidence)


def _sign_test_rank(n: int) -> tuple[int, float]:
    """The largest k for which (k-th smallest, k-th largest) of n holds the median with CONFIDENCE, else 1; and its
    confidence 1 - 2 P(Binomial(n, 1/2) < k)."""
    ranks = np.arange(1, max(n // 2, 1) + 1)
    confidence = 1.0 - 2.0 * bdtr(ranks - 1, n, 0.5)
    rank = max(1, int(np.sum(confidence >= CONFIDENCE)))
    return rank, float(confidence[rank - 1])
