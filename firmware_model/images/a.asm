; Design A: a whole cycle from any state, through three states and back, by pulses of either polarity.
; 12 MHz: one machine cycle is 1 us. Cycle numbers count from the cycle in which JB or JNB samples P3.2.

        .module a
        .include "rtec.inc"

WORD_TOTALS     = 0
GATE            = GATE_A
FAST_COUNTS     = FAST_A
ARMING          = ARMING_A

        .macro  PASS
        .endm
        .macro  DESIGN_START
        setb    TR1
        .endm
        .include "common.asm"

        .if ONE_CLOCK
; Reading the state behind the latch would take 8 clocks before the first change. So the state is foretold: from the lines
; at the arming, and the way that the axis went in the last tick. Where another one comes, the pulses change nothing, or
; one line and back; a look behind them says so, and no step is booked.
        .macro  BEFORE_SEARCH   ?backward,?chosen
        mov     a,DELTA_HIGH
        jb      ACC+7,backward
        mov     dptr,#forward_plus
        jnb     F_MINUS,chosen
        mov     dptr,#forward_minus
        sjmp    chosen
backward:
        mov     dptr,#backward_plus
        jnb     F_MINUS,chosen
        mov     dptr,#backward_minus
chosen:
        .endm
        .macro  BEFORE_QUESTION
        GATE_FINE
        .endm
        .macro  INSERT_AFTER_FALL       ?late
        mov     a,P3
        jnb     DIFFER,late             ; it came just now: too late for this one
        ARM_BY_TABLE
late:   ajmp    late_fall
        .endm
        .macro  INSERT_AFTER_RISE       ?late
        mov     a,P3
        jb      DIFFER,late
        ARM_BY_TABLE
late:   ajmp    late_rise
        .endm
        .macro  ARM_BY_TABLE
        anl     a,#LINES
        rl      a
        rl      a
        jmp     @a+dptr                 ; the levels of A (40h) and B (80h): a piece has 64 bytes
        .endm
        .include "seek_xor.asm"

lost_fall:
        jnb     DIFFER,came_late
        ajmp    refused_fall            ; two transitions between two looks
came_late:
        ajmp    late_fall
lost_rise:
        jb      DIFFER,rose_late
        ajmp    refused_rise
rose_late:
        ajmp    late_rise

; The pulses are over; A has the lines behind the latch, and 0 where they are those of the foretold state.
made:   jz      inserted_a
        jb      DIFFER,other_rise
        ajmp    turned_fall
other_rise:
        ajmp    turned_rise
inserted_a:
        ajmp    inserted

; One piece: the last questions, the loop, and the step in the state that is foretold.
        .macro  PULSES  first,second,state
        clr     EA                      ; neither tick nor probe from here on
        clr     HOLD_N
        clr     first                   ; 9 clocks after the look's begin
        PAUSE
        clr     second
        PAUSE
        setb    first
        PAUSE
        setb    second
        PAUSE_AND_LOOK
        setb    HOLD_N
        anl     a,#LINES
        xrl     a,#state
        ajmp    made
        .endm
        .macro  FALL    first,second,state,?begin,?armed,?late,?lost
begin:  jb      IE0,lost
        jnb     DIFFER,late             ; ... or it came between
armed:  jb      DIFFER,armed
        PULSES  first,second,state
lost:   ajmp    lost_fall
late:   ajmp    late_fall
        .ds     64 - (. - begin)
        .endm
        .macro  RISE    first,second,state,?begin,?armed,?late,?lost
begin:  jb      IE0,lost
        jb      DIFFER,late
armed:  jnb     DIFFER,armed
        PULSES  first,second,state
lost:   ajmp    lost_rise
late:   ajmp    late_rise
        .ds     64 - (. - begin)
        .endm
forward_plus:
        RISE    DRIVE_B_N,PULL_A_N,LINE_A       ; from 00: 10 11 01 00 10
        FALL    PULL_A_N,PULL_B_N,LINES         ; from 10: 11 01 00 10 11
        FALL    DRIVE_A_N,DRIVE_B_N,0           ; from 01: 00 10 11 01 00
        RISE    PULL_B_N,DRIVE_A_N,LINE_B       ; from 11: 01 00 10 11 01
forward_minus:
        RISE    PULL_A_N,DRIVE_B_N,LINE_A       ; from 00: 10 00 01 11 10
        FALL    PULL_B_N,PULL_A_N,LINES         ; from 10: 11 10 00 01 11
        FALL    DRIVE_B_N,DRIVE_A_N,0           ; from 01: 00 01 11 10 00
        RISE    DRIVE_A_N,PULL_B_N,LINE_B       ; from 11: 01 11 10 00 01
backward_plus:
        RISE    PULL_B_N,DRIVE_A_N,LINE_B       ; from 00: 01 00 10 11 01
        FALL    DRIVE_A_N,DRIVE_B_N,0           ; from 10: 00 10 11 01 00
        FALL    PULL_A_N,PULL_B_N,LINES         ; from 01: 11 01 00 10 11
        RISE    DRIVE_B_N,PULL_A_N,LINE_A       ; from 11: 10 11 01 00 10
backward_minus:
        RISE    DRIVE_A_N,PULL_B_N,LINE_B       ; from 00: 01 11 10 00 01
        FALL    DRIVE_B_N,DRIVE_A_N,0           ; from 10: 00 01 11 10 00
        FALL    PULL_B_N,PULL_A_N,LINES         ; from 01: 11 10 00 01 11
        RISE    PULL_A_N,DRIVE_B_N,LINE_A       ; from 11: 10 00 01 11 10

; No loop at rest, but the piece that waits for this state where the axis goes forward: from A as B is, B as A is not.
LOOKED          = 9             ; bytes of the questions and the loop
at_rest:
        clr     HOLD_N                  ; the latch closes before the state is read
        mov     dptr,#(forward_plus + LOOKED)
        jnb     F_MINUS,rest_plus
        mov     dptr,#(forward_minus + LOOKED)
rest_plus:
        clr     a
        mov     c,LINE_B_PIN
        mov     ACC+6,c
        mov     c,LINE_A_PIN
        cpl     c
        mov     ACC+7,c
        jmp     @a+dptr

        .else
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
        .macro  BEFORE_QUESTION
        .endm
        .macro  INSERT_AFTER_FALL       ?armed,?late,?lost
        jnb     DIFFER,late             ; it came just now: too late for this one
        jb      IE0,lost                ; two transitions between two looks
        jnb     DIFFER,late             ; ... or it came between
armed:  jb      DIFFER,armed            ; cycles 0, 1
        clr     EA                      ; cycle 2: neither tick nor probe from here on
        INSERT_NOW
lost:   ajmp    refused_fall
late:   ajmp    late_fall
        .endm
        .macro  INSERT_AFTER_RISE       ?armed,?late,?lost
        jb      DIFFER,late
        jb      IE0,lost
        jb      DIFFER,late
armed:  jnb     DIFFER,armed            ; cycles 0, 1
        clr     EA                      ; cycle 2
        INSERT_NOW
lost:   ajmp    refused_rise
late:   ajmp    late_rise
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
        ajmp    inserted
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
        .endif
