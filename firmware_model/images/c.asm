; Design C: inverters in A and B, toggled one after the other; which first follows from same/different and the sign.
; 12 MHz: one machine cycle is 1 us. Cycle numbers count from the cycle in which JB or JNB samples P3.2.

        .module c
        .include "rtec.inc"

WORD_TOTALS     = 0
GATE            = GATE_C
FAST_COUNTS     = FAST_C
ARMING          = ARMING_C

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
        PAUSE
        cpl     second                  ; cycle 5
        PAUSE
        setb    HOLD_N                  ; cycle 6
        ajmp    inserted
        .endm
        .macro  INSERT_AFTER_FALL       ?plus,?minus,?late,?arm,?lost
        jb      F_MINUS,arm
        jnb     DIFFER,late             ; it came just now: too late for this one
        jb      IE0,lost                ; two transitions between two looks
        jnb     DIFFER,late             ; ... or it came between
plus:   jb      DIFFER,plus             ; cycles 0, 1
        clr     EA                      ; cycle 2: neither tick nor probe from here on
        TOGGLE  INVERT_A_N,INVERT_B_N
arm:    jnb     DIFFER,late
        jb      IE0,lost
        jnb     DIFFER,late
minus:  jb      DIFFER,minus            ; cycles 0, 1
        clr     EA                      ; cycle 2
        TOGGLE  INVERT_B_N,INVERT_A_N
lost:   ajmp    refused_fall
late:   ajmp    late_fall
        .endm
        .macro  INSERT_AFTER_RISE       ?plus,?minus,?late,?arm,?lost
        jb      F_MINUS,arm
        jb      DIFFER,late
        jb      IE0,lost
        jb      DIFFER,late
plus:   jnb     DIFFER,plus             ; cycles 0, 1
        clr     EA                      ; cycle 2
        TOGGLE  INVERT_B_N,INVERT_A_N
arm:    jb      DIFFER,late
        jb      IE0,lost
        jb      DIFFER,late
minus:  jnb     DIFFER,minus            ; cycles 0, 1
        clr     EA                      ; cycle 2
        TOGGLE  INVERT_A_N,INVERT_B_N
lost:   ajmp    refused_rise
late:   ajmp    late_rise
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
