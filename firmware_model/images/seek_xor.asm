; Designs A and C: search for a transition slow enough to insert behind, by the exclusive OR of A and B on P3.2.
; An image defines before it includes this file: ARMING; the macros BEFORE_SEARCH and, for the gate's length,
; BEFORE_QUESTION; the macros INSERT_AFTER_FALL and INSERT_AFTER_RISE, which wait for the transition in a loop of one JB
; or JNB, insert and go on at `inserted`, or at `turned_rise` and `turned_fall`; and the label `at_rest`.

; A reading is over: insert, search, or wait for the next one.
work:
        jnb     F_OWED,idle
        jb      F_FAST,idle
        jnb     F_REST,seek
        jb      IE0,seek                ; it has just begun to move
        clr     EA                      ; at rest there is no transition to wait for: the insertion just starts
        ljmp    at_rest
idle:   jnb     TF0,idle
        ljmp    tick

; A transition, then the gate's time, then the next one; or one more between, as the period of the exclusive OR is
; two transitions. Timer 0 breaks out of these loops.
seek:
        clr     F_REST
        BEFORE_SEARCH
        setb    ET0
        jnb     F_TIMED,first
        jb      IE0,first               ; transitions went by while the last insertion was booked
        mov     c,F_LEVEL
        jb      DIFFER,resume_high
        jc      first                   ; the level has changed since: one went by unseen
        sjmp    low_gate
resume_high:
        jc      high_gate
first:  jb      DIFFER,first_fall
first_rise:
        jnb     DIFFER,first_rise
        sjmp    time_rise
first_fall:
        jb      DIFFER,first_fall
        sjmp    time_fall

refused_rise:
        inc     REFUSED
time_rise:
        clr     F_TIMED                 ; cycle 2: void until all of this is done, the tick may break in
        setb    F_MOVED                 ; cycle 3
        clr     IE0                     ; cycle 4: it remembers the next fall
        GATE_START                      ; cycles 5, 6
        setb    F_LEVEL
        clr     F_HALF
        BEFORE_QUESTION
        setb    F_TIMED
        jb      IE0,refused_fall        ; one came meanwhile
high_gate:
        GATE_OVER_EARLY arm_fall
        jb      DIFFER,high_gate
        clr     F_TIMED                 ; one transition between: the period ends with the next
        setb    F_MOVED
        clr     IE0
        setb    F_HALF
between_low:
        GATE_OVER arm_rise
        jnb     DIFFER,between_low
        sjmp    refused_rise            ; half a cycle in less than the gate's time

refused_fall:
        inc     REFUSED
time_fall:
        clr     F_TIMED
        setb    F_MOVED
        clr     IE0
        GATE_START
        clr     F_LEVEL
        clr     F_HALF
        BEFORE_QUESTION
        setb    F_TIMED
        GATE_EVEN
low_gate:
        GATE_OVER_EARLY arm_rise
        jnb     DIFFER,low_gate
        clr     F_TIMED
        setb    F_MOVED
        setb    F_HALF
between_high:
        GATE_OVER arm_fall
        jb      DIFFER,between_high
        sjmp    refused_fall

; What comes during the arming is the one between, and the period, long enough by then, ends with the next. Where it is
; that next one, it is too fast.
late_rise:
        jb      F_HALF,refused_rise
        clr     F_TIMED
        setb    F_MOVED
        setb    F_HALF
arm_fall:
        INSERT_AFTER_FALL
late_fall:
        jnb     F_HALF,fall_between
        ajmp    refused_fall
fall_between:
        clr     F_TIMED
        setb    F_MOVED
        clr     IE0
        setb    F_HALF
arm_rise:
        INSERT_AFTER_RISE

; The axis turned back, or went on, before the latch closed: a refusal, timed from the transition that came then.
turned_rise:
        setb    HOLD_N
        setb    EA
        ajmp    refused_rise
turned_fall:
        setb    HOLD_N
        setb    EA
        ajmp    refused_fall

; The insertion is over, interrupts are off.
inserted:
        clr     ET0                     ; the tick waits until this one is booked
        GATE_START                      ; the transition just used is the first of the next pair; timed late: no harm
        clr     IE0                     ; before the level is read: a fall meanwhile is remembered
        mov     c,DIFFER
        mov     F_LEVEL,c
        clr     F_HALF
        setb    F_TIMED
        jb      F_REST,still            ; set only where the insertion did not follow a transition
        setb    F_MOVED
still:  setb    EA
        lcall   book
        ljmp    work
