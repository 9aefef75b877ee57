"""State of the box between encoder and controller, as compiled code keeps it."""

from __future__ import annotations

import numpy as np

IDLE, ARMED, INSERTING, LETTING_GO, SAMPLING, WRITING, RUNNING = 0, 1, 2, 3, 4, 5, 6
"""What the next event of the box is: none, start of an insertion, its next change, end of holding, for Design B the
sampling and the writing of the lines, and whatever the timing of the firmware says."""

INJECTOR = np.dtype(
    [
        # parameters
        ("design", np.int64),
        ("poll_ps", np.int64),  # the processor looks at the lines at whole multiples of this (0: always)
        ("poll_offset_ps", np.int64),
        ("decide_ps", np.int64),  # from the look that recognises the moment to the first change
        ("step_ps", np.int64),  # between the changes of one insertion
        ("recover_ps", np.int64),  # after the last change, before the processor looks again
        ("latency_ps", np.int64),  # Design B: from sampling the lines to writing them
        ("gate_ps", np.int64),  # least interval that the speed gate lets through (0: no gate)
        ("rest_ps", np.int64),  # without an edge for so long the axis counts as at rest
        ("holds", np.int64),  # 1: real transitions are held back during an insertion
        ("releases", np.int64),  # Design C, loss of power: 1 drops the inverters, 0 latches them
        # the firmware's own timing (0: the times above)
        ("program", np.int64),
        ("effects", np.int64),
        ("cycle_ps", np.int64),
        ("sample_ps", np.int64),
        ("start_ps", np.int64),  # when a reading begins
        ("gate_counts", np.int64),  # of the gate's timer
        ("fast_counts", np.int64),  # between two readings: beyond them, no search begins
        # state
        ("enabled", np.int64),
        ("powered", np.int64),
        ("closing", np.int64),  # 1: the power goes once nothing is under way
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
        # where the firmware is (see `_firmware_kernels`); cycles where no other unit is said
        ("origin_ps", np.int64),
        ("place", np.int64),
        ("begin", np.int64),
        ("at", np.int64),
        ("cuts", np.int64),
        ("turn", np.int64),
        ("awaited", np.int64),
        ("exact", np.int64),
        ("breakable", np.int64),
        ("chores", np.int64),
        ("noting", np.int64),
        ("noted", np.int64),
        ("refusing", np.int64),
        ("event", np.int64),
        ("event_cycle", np.int64),
        ("pin", np.int64),
        ("pin_before", np.int64),
        ("pin_cycle", np.int64),
        ("fell", np.int64),
        ("fell_before", np.int64),
        ("forgotten", np.int64),
        ("over", np.int64),
        ("over_before", np.int64),
        ("alarm", np.int64),
        ("timed", np.int64),
        ("level", np.int64),
        ("half", np.int64),
        ("half_gate", np.int64),
        ("moved", np.int64),
        ("rest", np.int64),
        ("fast", np.int64),
        ("owed", np.int64),
        ("minus", np.int64),
        ("accepted", np.int64),
        ("judging", np.int64),
        ("count", np.int64),
        ("read_count", np.int64),
        ("delta", np.int64),
        ("closing_cycle", np.int64),
        ("piece", np.int64),
        ("running", np.int64),
        ("asked", np.int64),
    ],
    align=True,
)
