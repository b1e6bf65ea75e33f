"""Arrays that kernels hand on without their owners."""

from __future__ import annotations

import sys

import numpy as np

from cps_envs.core.compiled import borrowed, kernel


@kernel
def double_row(array, row):
    view = borrowed(array)[row]
    for i in range(view.size):
        view[i] *= 2.0


def test_what_is_borrowed_is_the_array_itself_and_stays_with_its_owner():
    array = np.arange(6.0).reshape(2, 3)
    owners = sys.getrefcount(array)
    for _ in range(3):
        double_row(array, 1)
    assert array.tolist() == [[0, 1, 2], [24, 32, 40]]
    assert sys.getrefcount(array) == owners
