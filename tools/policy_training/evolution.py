"""The covariance matrix adaptation evolution strategy (CMA-ES), which maximises a noisy score.

N. Hansen, The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772, with its default parameters.
"""

from __future__ import annotations

import numpy as np

from .network import Floats


class Evolution:
    """The state of one evolution: ask for candidates, score them, tell the scores.

    `mean` (n,) is the best guess so far, in units of the caller; `step` (n,) how far the first
    generation looks.
    """

    def __init__(
        self, mean: Floats, step: Floats, size: int, generator: np.random.Generator
    ) -> None:
        self.n, self.size, self.generator = len(mean), size, generator
        self.unit, self.origin = step, mean
        self.center = np.zeros(self.n)
        parents = size // 2
        weights = np.log(parents + 0.5) - np.log(np.arange(1, parents + 1))
        self.weights = weights / weights.sum()
        self.effective = 1 / np.square(self.weights).sum()
        n, effective = self.n, self.effective
        self.path_rate = (4 + effective / n) / (n + 4 + 2 * effective / n)
        self.step_rate = (effective + 2) / (n + effective + 5)
        self.rank_one = 2 / ((n + 1.3) ** 2 + effective)
        self.rank_many = min(
            1 - self.rank_one, 2 * (effective - 2 + 1 / effective) / ((n + 2) ** 2 + effective)
        )
        self.damping = 1 + 2 * max(0, np.sqrt((effective - 1) / (n + 1)) - 1) + self.step_rate
        self.length = np.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n))
        self.path, self.step_path = np.zeros(n), np.zeros(n)
        self.covariance, self.sigma, self.generation = np.eye(n), 1.0, 0
        # Of the covariance, and the steps of the generation that was asked for.
        self.basis, self.spread = np.eye(n), np.ones(n)
        self.steps = np.zeros((size, n))

    @property
    def mean(self) -> Floats:
        """Return the best guess, (n,)."""
        return self.origin + self.unit * self.center

    def ask(self) -> Floats:
        """Return a generation of candidates, (size, n)."""
        values, self.basis = np.linalg.eigh(self.covariance)
        self.spread = np.sqrt(np.maximum(values, 1e-14))
        draws = self.generator.standard_normal((self.size, self.n))
        self.steps = draws * self.spread @ self.basis.T
        return self.origin + self.unit * (self.center + self.sigma * self.steps)

    def tell(self, scores: Floats) -> None:
        """Move the search after the scores, (size,), of the candidates that were asked for."""
        best = self.steps[np.argsort(-scores)[: len(self.weights)]]
        move = self.weights @ best
        self.generation += 1
        self.center = self.center + self.sigma * move
        white = self.basis @ (self.basis.T @ move / self.spread)
        rate = self.step_rate
        self.step_path = (1 - rate) * self.step_path + np.sqrt(
            rate * (2 - rate) * self.effective
        ) * white
        length = np.linalg.norm(self.step_path)
        fade = np.sqrt(1 - (1 - rate) ** (2 * self.generation))
        moving = float(length / fade < (1.4 + 2 / (self.n + 1)) * self.length)
        rate = self.path_rate
        self.path = (1 - rate) * self.path + moving * np.sqrt(
            rate * (2 - rate) * self.effective
        ) * move
        kept = 1 - self.rank_one - self.rank_many + (1 - moving) * self.rank_one * rate * (2 - rate)
        self.covariance = (
            kept * self.covariance
            + self.rank_one * np.outer(self.path, self.path)
            + self.rank_many * (best.T * self.weights) @ best
        )
        self.sigma *= np.exp(self.step_rate / self.damping * (length / self.length - 1))
