; Design C: inverters in A and B, toggled one after the other; which first follows from same/different and the sign.
; 12 MHz: one machine cycle is 1 us. Cycle numbers count from the cycle in which JB or JNB samples P3.2.

        .module c
        .include "rtec.inc"

WORD_TOTALS     = 0
GATE            = 19            ; us from one transition to the next but one: 2 * (2 + 4 + 1) us and 15 % more would be 17,
                                ; but the timer needs two cycles after it is set
FAST_COUNTS     = 105           ; counts in a tick at that speed
ARMING          = 8             ; cycles from the gate timer's end to the first look that may insert
ONE_LATE        = 0

        .macro  PASS
        .endm
        .macro  DESIGN_START
        setb    TR1
        .endm
        .include "common.asm"

; The order is known before the transition comes: it leads to "same" where it falls, to "different" where it rises.
        .macro  TOGGLE  first,second
        clr     HOLD_N                  ; cycle 3
        cpl     first                   ; cycle 4: 4 us after the look
        cpl     second                  ; cycle 5
        setb    HOLD_N                  ; cycle 6
        ljmp    inserted
        .endm
        .macro  INSERT_AFTER_FALL       ?plus,?minus,?late,?arm,?lost
        jb      F_MINUS,arm
        jnb     DIFFER,late             ; it came just now: too late for this one
        jb      IE0,lost                ; two transitions between two looks
plus:   jb      DIFFER,plus             ; cycles 0, 1
        clr     EA                      ; cycle 2: neither tick nor probe from here on
        TOGGLE  INVERT_A_N,INVERT_B_N
arm:    jnb     DIFFER,late
        jb      IE0,lost
minus:  jb      DIFFER,minus            ; cycles 0, 1
        clr     EA                      ; cycle 2
        TOGGLE  INVERT_B_N,INVERT_A_N
lost:   ljmp    refused_fall
late:   ljmp    late_fall
        .endm
        .macro  INSERT_AFTER_RISE       ?plus,?minus,?late,?arm,?lost
        jb      F_MINUS,arm
        jb      DIFFER,late
        jb      IE0,lost
plus:   jnb     DIFFER,plus             ; cycles 0, 1
        clr     EA                      ; cycle 2
        TOGGLE  INVERT_B_N,INVERT_A_N
arm:    jb      DIFFER,late
        jb      IE0,lost
minus:  jnb     DIFFER,minus            ; cycles 0, 1
        clr     EA                      ; cycle 2
        TOGGLE  INVERT_A_N,INVERT_B_N
lost:   ljmp    refused_rise
late:   ljmp    late_rise
        .endm
        .macro  BEFORE_SEARCH
        .endm
        .include "seek_xor.asm"

at_rest:
        clr     HOLD_N                  ; the latch closes before the state is read
        mov     c,F_MINUS
        jb      DIFFER,rest_differ
        jc      b_first
a_first:
        TOGGLE  INVERT_A_N,INVERT_B_N
rest_differ:
        jc      a_first
b_first:
        TOGGLE  INVERT_B_N,INVERT_A_N
