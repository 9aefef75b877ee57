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
; Behind a table the first change would come after 18 clocks. The exclusive OR tells two of the four states, so one look
; behind the latch tells the rest: at the line that changes second. Where the axis turned back before the latch closed,
; the other line is not as it has to be; then its pulse changes nothing, that of the second line goes the way of the
; step and back, and a look at the exclusive OR behind them says that nothing is inserted.
        .macro  BEFORE_SEARCH
        .endm
        .macro  BEFORE_QUESTION
        .endm
        .macro  PULSES  first,second,made
        clr     first                   ; 13 clocks after the look's begin, or 12
        PAUSE
        clr     second
        PAUSE
        setb    first
        PAUSE
        setb    second
        PAUSE_AND_LOOK  DIFFER
        setb    HOLD_N
        ajmp    made
        .endm
        .macro  INSERT_AFTER_FALL
        GATE_FINE
        jb      F_MINUS,same_arm_minus
        jnb     DIFFER,same_late        ; it came just now: too late for this one
        jb      IE0,same_lost           ; two transitions between two looks
        jnb     DIFFER,same_late        ; ... or it came between
same_armed_plus:
        jb      DIFFER,same_armed_plus
same_plus:
        clr     EA                      ; neither tick nor probe from here on
        clr     HOLD_N
        jb      LINE_B_PIN,s3_plus
        PULSES  DRIVE_A_N,DRIVE_B_N,made_same   ; 00 -> 10 11 01 00
s3_plus:
        PULSES  PULL_A_N,PULL_B_N,made_same     ; 11 -> 01 00 10 11
same_lost:
        ajmp    refused_fall
same_late:
        ajmp    late_fall
same_arm_minus:
        jnb     DIFFER,same_late
        jb      IE0,same_lost
        jnb     DIFFER,same_late
same_armed_minus:
        jb      DIFFER,same_armed_minus
same_minus:
        clr     EA
        clr     HOLD_N
        jb      LINE_A_PIN,s3_minus
        PULSES  DRIVE_B_N,DRIVE_A_N,made_same   ; 00 -> 01 11 10 00
s3_minus:
        PULSES  PULL_B_N,PULL_A_N,made_same     ; 11 -> 10 00 01 11
        .endm
        .macro  INSERT_AFTER_RISE
        GATE_FINE
        jb      F_MINUS,differ_arm_minus
        jb      DIFFER,differ_late
        jb      IE0,differ_lost
        jb      DIFFER,differ_late
differ_armed_plus:
        jnb     DIFFER,differ_armed_plus
differ_plus:
        clr     EA
        clr     HOLD_N
        jb      LINE_A_PIN,s2_plus
        PULSES  PULL_B_N,DRIVE_A_N,made_differ  ; 01 -> 00 10 11 01
s2_plus:
        PULSES  DRIVE_B_N,PULL_A_N,made_differ  ; 10 -> 11 01 00 10
differ_lost:
        ajmp    refused_rise
differ_late:
        ajmp    late_rise
differ_arm_minus:
        jb      DIFFER,differ_late
        jb      IE0,differ_lost
        jb      DIFFER,differ_late
differ_armed_minus:
        jnb     DIFFER,differ_armed_minus
differ_minus:
        clr     EA
        clr     HOLD_N
        jb      LINE_B_PIN,s4_minus
        PULSES  PULL_A_N,DRIVE_B_N,made_differ  ; 10 -> 00 01 11 10
s4_minus:
        PULSES  DRIVE_A_N,PULL_B_N,made_differ  ; 01 -> 11 10 00 01
        .endm
        .include "seek_xor.asm"

; The exclusive OR behind the latch: low behind a fall, high behind a rise, where the step has been inserted.
made_same:
        jnc     made
        ajmp    turned_rise
made_differ:
        jc      made
        ajmp    turned_fall
made:   ajmp    inserted

at_rest:
        clr     HOLD_N                  ; the latch closes before the state is read
        mov     c,F_MINUS
        jb      DIFFER,rest_differ
        jc      rest_same_minus
        ljmp    same_plus
rest_same_minus:
        ljmp    same_minus
rest_differ:
        jc      rest_differ_minus
        ljmp    differ_plus
rest_differ_minus:
        ljmp    differ_minus

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
