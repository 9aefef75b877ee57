; Design A: a whole cycle from any state, through three states and back, by pulses of either polarity.
; 12 MHz: one machine cycle is 1 us. Cycle numbers count from the cycle in which JB or JNB samples P3.2.

        .module a
        .include "rtec.inc"

WORD_TOTALS     = 0
GATE            = 30            ; us from one transition to the next but one: 2 * (2 + 8 + 3) us, and 15 % more
FAST_COUNTS     = 66            ; counts in a tick at that speed
ARMING          = 6             ; cycles from the gate timer's end to the first look that may insert
ONE_LATE        = 1

        .macro  PASS
        .endm
        .macro  DESIGN_START
        setb    TR1
        .endm
        .include "common.asm"

        .macro  INSERT_NOW
        clr     HOLD_N                  ; cycle 3: the state stays what it is
        mov     a,P3                    ; cycle 4
        anl     a,#LINES                ; cycle 5
        jmp     @a+dptr                 ; cycles 6, 7: to one of eight pieces; the first change is in cycle 8
        .endm
        .macro  BEFORE_SEARCH   ?chosen
        mov     dptr,#forward_cycles
        jnb     F_MINUS,chosen
        mov     dptr,#backward_cycles
chosen:
        .endm
        .macro  INSERT_AFTER_FALL       ?armed,?late,?lost
        jnb     DIFFER,late             ; it came just now: too late for this one
        jb      IE0,lost                ; two transitions between two looks
armed:  jb      DIFFER,armed            ; cycles 0, 1
        clr     EA                      ; cycle 2: neither tick nor probe from here on
        INSERT_NOW
lost:   ljmp    refused_fall
late:   ljmp    late_fall
        .endm
        .macro  INSERT_AFTER_RISE       ?armed,?late,?lost
        jb      DIFFER,late
        jb      IE0,lost
armed:  jnb     DIFFER,armed            ; cycles 0, 1
        clr     EA                      ; cycle 2
        INSERT_NOW
lost:   ljmp    refused_rise
late:   ljmp    late_rise
        .endm
        .include "seek_xor.asm"

at_rest:
        BEFORE_SEARCH
        INSERT_NOW

; One piece: the first line changes, the second, the first back, the second back, 1 us apart.
; The levels of A (10h) and B (20h) are the offset of the piece, so each takes 16 bytes.
        .macro  CYCLE   first,second,?begin
begin:  clr     first                   ; cycle 8
        clr     second                  ; cycle 9
        setb    first                   ; cycle 10
        setb    second                  ; cycle 11
        setb    HOLD_N                  ; cycle 12
        ljmp    inserted
        .ds     16 - (. - begin)
        .endm

forward_cycles:
        CYCLE   DRIVE_A_N,DRIVE_B_N     ; 00 -> 10 11 01 00
        CYCLE   DRIVE_B_N,PULL_A_N      ; 10 -> 11 01 00 10
        CYCLE   PULL_B_N,DRIVE_A_N      ; 01 -> 00 10 11 01
        CYCLE   PULL_A_N,PULL_B_N       ; 11 -> 01 00 10 11
backward_cycles:
        CYCLE   DRIVE_B_N,DRIVE_A_N     ; 00 -> 01 11 10 00
        CYCLE   PULL_A_N,DRIVE_B_N      ; 10 -> 00 01 11 10
        CYCLE   DRIVE_A_N,PULL_B_N      ; 01 -> 11 10 00 01
        CYCLE   PULL_B_N,PULL_A_N       ; 11 -> 10 00 01 11
