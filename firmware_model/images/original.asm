; The Original: two pulses of 2 us, overlapping by half, through an OR gate, in state 1 (A and B low) only.
; 12 MHz: one machine cycle is 1 us. Cycle numbers count from the cycle in which JB samples P3.2.

        .module original
        .include "rtec.inc"

WORD_TOTALS     = 0
GATE            = GATE_ORIGINAL
FAST_COUNTS     = FAST_ORIGINAL
ARMING          = ARMING_ORIGINAL

        .macro  PASS
        .endm
        .macro  DESIGN_START
        setb    TR1
        .endm
        .include "common.asm"

; A reading is over: insert, search, or wait for the next one.
work:
        jnb     F_OWED,idle
        jb      F_FAST,idle
        jnb     F_REST,seek
        jb      IE0,seek                ; it has just begun to move
        jb      LOW_N,seek              ; at rest, but not in state 1: nothing can be done
        clr     EA                      ; at rest there is no transition to wait for: the insertion just starts
        jb      F_MINUS,rest_minus
        sjmp    insert_plus
rest_minus:
        sjmp    insert_minus
idle:   jnb     TF0,idle
        ljmp    tick

; Search for two A&B-low signals that are far enough apart. Timer 0 breaks out of these loops.
seek:
        clr     F_REST
        setb    ET0
        jb      F_TIMED,timed
first:  jnb     LOW_N,first             ; out of state 1 ...
falls:  jb      LOW_N,falls             ; ... and into it: the first signal
start_timing:
        clr     F_TIMED                 ; cycle 2: void until all of this is done, the tick may break in
        setb    F_MOVED                 ; cycle 3
        clr     IE0                     ; cycle 4: it remembers the next one
        GATE_START                      ; cycles 5, 6
        setb    F_TIMED
timed:  GATE_TURN
        jnb     LOW_N,timed             ; still the same one
gate:   GATE_OVER slow_enough
        jb      LOW_N,gate
too_fast:
        inc     REFUSED                 ; the next signal came before the timer ran out; time from this one
        sjmp    start_timing
slow_enough:
        .if ONE_CLOCK
        nop                             ; the gate's fine adjustment
        .endif
        jb      IE0,too_fast            ; one went by between two looks
        jb      F_MINUS,arm_minus
        jnb     LOW_N,too_fast          ; it came just now: too late for it
armed_plus:
        jb      LOW_N,armed_plus        ; cycles 0, 1
        clr     EA                      ; cycle 2: neither tick nor probe from here on
insert_plus:
        clr     HOLD_N                  ; cycle 3
        jb      LOW_N,turned            ; cycles 4, 5: behind the latch; where it turned back before, it is not state 1
        clr     DRIVE_A_N               ; cycle 6: A high, 6 us after the look
        PAUSE
        clr     DRIVE_B_N               ; cycle 7: B high
        PAUSE
        setb    DRIVE_A_N               ; cycle 8: A low, 2 us wide
        PAUSE
        setb    DRIVE_B_N               ; cycle 9: B low, 3 us after the first change
        PAUSE
        setb    HOLD_N                  ; cycle 10: the 11 us are over
        sjmp    inserted
turned: setb    HOLD_N                  ; out of state 1 before the latch closed: nothing is inserted
        setb    EA
        jb      F_REST,seek
        sjmp    too_fast
arm_minus:
        jnb     LOW_N,too_fast
armed_minus:
        jb      LOW_N,armed_minus       ; cycles 0, 1
        clr     EA                      ; cycle 2
insert_minus:
        clr     HOLD_N                  ; cycle 3
        jb      LOW_N,turned            ; cycles 4, 5: behind the latch; where it turned back before, it is not state 1
        clr     DRIVE_B_N               ; cycle 6: B high, 6 us after the look
        PAUSE
        clr     DRIVE_A_N               ; cycle 7: A high
        PAUSE
        setb    DRIVE_B_N               ; cycle 8: B low, 2 us wide
        PAUSE
        setb    DRIVE_A_N               ; cycle 9: A low, 3 us after the first change
        PAUSE
        setb    HOLD_N                  ; cycle 10: the 11 us are over
inserted:
        clr     ET0                     ; the tick waits until this one is booked
        GATE_START                      ; the signal just used is the first of the next pair; timed late: no harm
        clr     IE0
        setb    F_TIMED
        jb      F_REST,still            ; set only where the insertion did not follow a transition
        setb    F_MOVED
still:  setb    EA
        lcall   book
        ljmp    work
