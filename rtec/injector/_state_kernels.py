"""State of the box between encoder and controller, as compiled code keeps it."""

from __future__ import annotations

import numpy as np

IDLE, ARMED, INSERTING, LETTING_GO, SAMPLING, WRITING = 0, 1, 2, 3, 4, 5
"""What the next event of the box is: none, start of an insertion, its next change, end of holding, and for
lines that pass through the processor the sampling and the writing of the lines."""

STUCK = HUNG = 2
"""Of a hold latch, and of a processor, that a fault keeps from working (`rtec.machine.box_faults`)."""

OWN = np.dtype(
    [
        # parameters
        ("function", np.int64),  # address of an algorithm's step; 0: the design's own steps are at work
        ("memory", np.int64),  # address of what it keeps
        # state
        ("fresh", np.int64),  # 1: the next call is the one at power-up
        ("since_ps", np.int64),  # when that is, or was
        ("calls", np.int64),  # by its own wish, since something has changed at its inputs
        # what it is called with: a time since power-up, levels, and a total since then
        ("t_ps", np.int64),
        ("ab", np.int64),
        ("requested", np.int64),
        # what it says
        ("levels", np.int64),
        ("completed", np.int64),
        ("wake_ps", np.int64),
        ("refused", np.int64),
        # observations
        ("entered", np.int64),  # calls
        ("left", np.int64),  # those that have returned
        ("broken", np.int64),  # how it ended, in words of whoever made the function; 0: it has not
        ("value", np.int64),  # that ended it
    ],
    align=True,
)
"""An algorithm of a user's in the place of a design's steps (`rtec.injector._own_kernels`)."""

INJECTOR = np.dtype(
    [
        # parameters
        ("changes", np.int64),  # level changes of an insertion, one state each
        ("in_path", np.int64),  # 1: the lines end at the processor, which writes them anew
        ("inverts", np.int64),  # 1: inverters in the lines; 0: pulses OR-ed and AND-ed to them
        ("one_state", np.int64),  # 1: it inserts with both lines low only, and times from one such moment to the next
        ("poll_ps", np.int64),  # the processor looks at the lines at whole multiples of this (0: always)
        ("poll_offset_ps", np.int64),
        ("decide_ps", np.int64),  # from the look that recognises the moment to the first change
        ("step_ps", np.int64),  # between the changes of one insertion
        ("recover_ps", np.int64),  # after the last change, before the processor looks again
        ("latency_ps", np.int64),  # Design B: from sampling the lines to writing them
        ("gate_ps", np.int64),  # least interval that the speed gate lets through (0: no gate)
        ("rest_ps", np.int64),  # without an edge for so long the axis counts as at rest
        ("holds", np.int64),  # 1: real transitions are held back during an insertion; STUCK: all are
        ("releases", np.int64),  # Design C, loss of power: 1 drops the inverters, 0 latches them
        # state
        ("enabled", np.int64),
        ("powered", np.int64),  # 0, 1, or HUNG: the outputs stay as they are, nothing is read or begun
        ("phase", np.int64),
        ("next_ps", np.int64),
        ("recognised_ps", np.int64),
        ("ready_ps", np.int64),
        ("ab_in", np.int64),
        ("held", np.int64),
        ("holding", np.int64),
        ("ab_out", np.int64),
        ("pulse_high", np.int64),
        ("pulse_low", np.int64),
        ("inverted", np.int64),
        ("sampled", np.int64),
        ("offset", np.int64),
        ("origin", np.int64),  # angle state at the start of the insertion
        ("sign", np.int64),
        ("done", np.int64),  # changes made of the insertion under way
        ("last_edge_ps", np.int64),
        ("edge_before_ps", np.int64),  # Original: when both lines went low last
        ("interval_ps", np.int64),  # what the speed gate measures
        ("requested", np.int64),  # totals in steps of the design
        ("completed", np.int64),
        # observations
        ("inserted", np.int64),  # insertions made, of either sign
        ("refused", np.int64),  # moments at which the speed gate refused one
        ("trigger_ps", np.int64),  # what the insertion follows
        ("longest_ps", np.int64),  # longest time from there to the last change
        ("real_inside", np.int64),  # real edges that fell between the look and the last change of an insertion
        ("seen_in", np.int64),  # levels that the monitor has counted on either side
        ("seen_out", np.int64),
        ("angle", np.int64),  # between them, in states
        ("ahead", np.int64),  # counts by which the controller's side went ahead of the encoder's
        ("illegal_out", np.int64),  # changes of both lines at one instant
        ("own", OWN),
    ],
    align=True,
)
