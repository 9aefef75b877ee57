"""Errors: what travels between processes."""

import copy

import pytest

from rtec.errors import ArgumentError, FileFormatError, OutputError


@pytest.mark.parametrize(
    "error",
    [
        ArgumentError("feed", -3, "a speed above 0 mm/s", "write one"),
        FileFormatError("z.csv", 7, "no number", "a number"),
        OutputError("the disk is full"),
    ],
)
def test_an_error_of_a_worker_arrives_whole(error):
    again = copy.copy(error)  # as a worker sends it
    assert (type(again), str(again), vars(again)) == (type(error), str(error), vars(error))
