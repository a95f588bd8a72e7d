"""Processes that work beside each other."""

from __future__ import annotations

import os
import time
from concurrent.futures.process import BrokenProcessPool

import pytest

from statemachine.processes.parallel import worker_processes

from .conftest import refused


def test_a_worker_that_ends_loses_nothing_of_another() -> None:
    pytest.importorskip("joblib")
    with worker_processes(2) as (first, second):
        waits = second(time.sleep, 1.0)
        refused((BrokenProcessPool, "", first(os._exit, 1).result))
        assert (first(abs, -1).result(60), waits.result(60)) == (1, None)
