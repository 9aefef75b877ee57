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
; Where it turned back, or went on, before the latch closed, the order would be the wrong one: hence one look more behind
; the latch.
        .macro  TOGGLE  first,second
        cpl     first                   ; cycle 6: 6 us after the look
        PAUSE
        cpl     second                  ; cycle 7
        PAUSE
        setb    HOLD_N                  ; cycle 8
        ajmp    inserted
        .endm
        .macro  LOOK_FOR_FALL   late
        .if ONE_CLOCK                   ; a 12-clock part has no time for it
        jnb     DIFFER,late
        .endif
        .endm
        .macro  LOOK_FOR_RISE   late
        .if ONE_CLOCK
        jb      DIFFER,late
        .endif
        .endm
        .macro  INSERT_AFTER_FALL       ?plus,?minus,?late,?arm,?seen,?turned
        jb      F_MINUS,arm
        LOOK_FOR_FALL   late
        jb      IE0,seen
        jnb     DIFFER,late             ; it came just now: too late for this one
plus:   jb      DIFFER,plus             ; cycles 0, 1
        clr     EA                      ; cycle 2: neither tick nor probe from here on
        clr     HOLD_N                  ; cycle 3
        jb      DIFFER,turned           ; cycles 4, 5
        TOGGLE  INVERT_A_N,INVERT_B_N
arm:    LOOK_FOR_FALL   late
        jb      IE0,seen
        jnb     DIFFER,late
minus:  jb      DIFFER,minus            ; cycles 0, 1
        clr     EA                      ; cycle 2
        clr     HOLD_N                  ; cycle 3
        jb      DIFFER,turned           ; cycles 4, 5
        TOGGLE  INVERT_B_N,INVERT_A_N
turned: ajmp    turned_rise
seen:   jnb     DIFFER,late
        ajmp    refused_fall            ; two transitions between two looks
late:                                   ; late_fall is what follows
        .endm
        .macro  INSERT_AFTER_RISE       ?plus,?minus,?late,?arm,?lost,?turned
        jb      F_MINUS,arm
        LOOK_FOR_RISE   late
        jb      IE0,lost
        jb      DIFFER,late
plus:   jnb     DIFFER,plus             ; cycles 0, 1
        clr     EA                      ; cycle 2
        clr     HOLD_N                  ; cycle 3
        jnb     DIFFER,turned           ; cycles 4, 5
        TOGGLE  INVERT_B_N,INVERT_A_N
arm:    LOOK_FOR_RISE   late
        jb      IE0,lost
        jb      DIFFER,late
minus:  jnb     DIFFER,minus            ; cycles 0, 1
        clr     EA                      ; cycle 2
        clr     HOLD_N                  ; cycle 3
        jnb     DIFFER,turned           ; cycles 4, 5
        TOGGLE  INVERT_A_N,INVERT_B_N
turned: ajmp    turned_fall
lost:   ajmp    refused_rise
late:   ajmp    late_rise
        .endm
        .macro  BEFORE_SEARCH
        .endm
        .macro  BEFORE_QUESTION
        .if ONE_CLOCK
        .else
        nop                             ; behind a rise the timer is over when it is asked for the first time; a turn
        nop                             ; of the loop more would be 4 cycles
        nop
        .endif
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
