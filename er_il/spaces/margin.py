"""The choice of ERX's weights W: as far from folds as linear coordinates W q can be, by kinematics alone.

The margin of a configuration with the self-motion N (rows) is the smallest singular value of W N^T
(:func:`er_il.kinematics.self_motion.margins`); at 0 two solutions meet.

Along demonstrations of an arm with one redundant joint the smallest margin is maximised, which is a convex problem
once the signs of the self-motions n_k are known: the largest t with w.n_k >= t and |w| <= 1. They are continuous along
an episode, and its common sign is the one that w prefers, again and again until none changes.

Without demonstrations an arm works somewhere around its home. There signs mean nothing, and with several redundant
joints there is none; then the generalised mean M_p = (mean |det W N^T|^-p)^(-1/p) is maximised locally, from the best
of several starts. |det W N^T| is no larger than the margin, and the same with one redundant joint. p = 0 is the
geometric mean, in which a fold counts without bound and no single configuration decides; large p approach the smallest.

Over the whole workspace every W has folds, and the best for it has them where arms work: fitted to all configurations
within the limits, a Panda's margin is 0.3 at home; fitted around home, it is 1, and no fewer round trips over the whole
workspace return their joints.
"""

import itertools
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.linalg import qr
from scipy.optimize import minimize, nnls

from er_il.arms.arm import Arm, Vector, Weights
from er_il.kinematics.self_motion import self_motions
from er_il.spaces.base import Array

AROUND = 0.8  # [rad] of each joint from home, as far as its limits let it: where an arm works that nothing is known of
SAMPLES, SAMPLES_SEED = 1000, 0  # configurations around home
DECIMALS = 4  # of the weights: similar data shall have the same, and a name shall hold them
EXPONENTS = (0.0, 4.0, 16.0, 64.0)  # of the generalised mean along demonstrations, one after the other
STARTS = 5  # of the search for the mean's maximum: the best of the joints, and what sees most of the self-motion
TRIES = 20  # at most, until no episode changes its sign
SUBSET = 200  # self-motions with which the convex problem begins; those that it violates join
SLACK = 1e-9


@lru_cache
def home_weights(arm: Arm) -> Weights:
    """W (n-6, n) with the largest geometric mean of the margins around an arm's home."""
    ways = np.random.default_rng(SAMPLES_SEED).uniform(-AROUND, AROUND, (SAMPLES, arm.dof))
    return _rounded(_best_mean(self_motions(arm, arm.within_limits(arm.home + ways)), 0.0))


def demonstrated_weights(arm: Arm, demos: Sequence[Array]) -> Weights:
    """W (n-6, n) with the largest smallest margin along demonstrations, each (T, n) [rad] in time order.

    Where every w crosses a fold on the way, the one with the largest geometric mean of the margins.
    """
    episodes = [self_motions(arm, demo) for demo in demos]
    every = np.concatenate(episodes)
    W = _best_mean(every, 0.0)
    if arm.redundancy == 1:
        found = _aligned([_continuous(each[:, 0]) for each in episodes], W[0])
        return _rounded(W if found is None else found[None])
    for exponent in EXPONENTS[1:]:
        W = _improved(every, W, exponent)
    return _rounded(W)


def _continuous(n: Array) -> Array:
    """Unit self-motions (T, n) with signs that are continuous in time."""
    turns = np.sign(np.einsum("ti,ti->t", n[1:], n[:-1]))
    return n * np.cumprod(np.concatenate([[1.0], np.where(turns == 0.0, 1.0, turns)]))[:, None]


def _aligned(episodes: Sequence[Array], w: Vector) -> Vector | None:
    """The w of the largest margin along episodes (T, n) of unit self-motions, each with a sign of its own."""
    found, signs = None, None
    for _ in range(TRIES):
        wanted = [1.0 if (each @ w).sum() >= 0.0 else -1.0 for each in episodes]
        if wanted == signs:
            break
        signs = wanted
        found = _largest_margin(np.concatenate([sign * each for sign, each in zip(signs, episodes, strict=True)]))
        if found is None:
            return None
        w = found
    return found


def _largest_margin(normals: Array) -> Vector | None:
    """The unit w with the largest t in w.n_k >= t for all rows n_k (K, n); None if t would not be positive.

    The same as the shortest v with v.n_k >= 1: a least-distance program, by Lawson and Hanson's way through
    nonnegative least squares (Solving Least Squares Problems, 1974, chapter 23).
    """
    chosen = np.zeros(len(normals), dtype=bool)
    chosen[:: 1 + len(normals) // SUBSET] = True
    while True:
        some = normals[chosen]
        E = np.vstack([some.T, np.ones(len(some))])
        f = np.eye(len(E))[-1]
        r = E @ nnls(E, f)[0] - f
        if r @ r < SLACK:
            return None
        v = -r[:-1] / r[-1]
        violated = (normals @ v < 1.0 - SLACK) & ~chosen
        if not violated.any():
            return v / np.linalg.norm(v)
        chosen |= violated


def _best_mean(bases: Array, exponent: float) -> Array:
    """W (m, n) with the largest generalised mean over self-motions (N, m, n), the best of several starts."""
    m, n = bases.shape[1:]
    main = np.linalg.eigh(np.einsum("kmi,kmj->ij", bases, bases))[1][:, -m:].T  # sees most of the self-motion's square
    starts = [main, *(np.eye(n)[list(joints)] for joints in itertools.combinations(range(n), m))]

    def loss(W: Array) -> float:
        return _mean_loss(W.ravel(), bases, exponent)[0]

    return min((_improved(bases, start, exponent) for start in sorted(starts, key=loss)[:STARTS]), key=loss)


def _improved(bases: Array, W: Array, exponent: float) -> Array:
    """W (m, n) at the local maximum of the generalised mean near a start, rows orthonormal."""
    found = minimize(_mean_loss, W.ravel(), (bases, exponent), method="L-BFGS-B", jac=True).x
    return np.linalg.qr(found.reshape(W.shape).T)[0].T


def _mean_loss(weights: Vector, bases: Array, exponent: float) -> tuple[float, Vector]:
    """-log of the generalised mean of |det W N^T| with orthonormalised rows of W, and its gradient by W."""
    W = weights.reshape(bases.shape[1:])
    seen = W @ bases.transpose(0, 2, 1)  # (N, m, m)
    seen += 1e-12 * np.eye(len(W))  # invertible at a fold, too
    square = W @ W.T
    loss = 0.5 * np.linalg.slogdet(square)[1] - np.linalg.slogdet(seen)[1]  # (N,)
    shares = np.exp(exponent * (loss - loss.max()))
    shares /= shares.sum()
    gradient = np.linalg.solve(square, W) - np.einsum("k,kij,kil->jl", shares, np.linalg.inv(seen), bases)
    power = float(loss.mean())
    if exponent:
        power = float(loss.max() + np.log(np.exp(exponent * (loss - loss.max())).mean()) / exponent)
    return power, gradient.ravel()


def _rounded(W: Array) -> Weights:
    """The same coordinates by rows that are unique: triangular in the joints that weigh most.

    The first joint that weighs at least half as much as a row's largest is positive, so that similar rows look alike.
    """
    _, R, order = qr(W, mode="economic", pivoting=True)
    rows = np.empty_like(W)
    rows[:, order] = R
    first = (np.abs(rows) >= 0.5 * np.abs(rows).max(axis=1, keepdims=True)).argmax(axis=1, keepdims=True)
    rows *= np.sign(np.take_along_axis(rows, first, axis=1))
    return tuple(tuple((row + 0.0).tolist()) for row in rows.round(DECIMALS))
