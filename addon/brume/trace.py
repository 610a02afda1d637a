# SPDX-License-Identifier: GPL-3.0-or-later
"""What the viewport did when, for tests and benchmarks: off unless `events` is a list."""

import time
from contextlib import contextmanager

events = None  # or a list of (name, start, end, values), times by time.perf_counter()


@contextmanager
def span(name):
    """Notes what happens inside; gives a dictionary for the values to be noted with it."""
    if events is None:
        yield {}
        return
    values, start = {}, time.perf_counter()
    try:
        yield values
    finally:
        events.append((name, start, time.perf_counter(), values))


def note(name, start, **values):
    """Notes what began at `start` and ended just now."""
    if events is not None:
        events.append((name, start, time.perf_counter(), values))
