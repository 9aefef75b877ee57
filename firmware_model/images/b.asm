; Design B: A and B pass through the processor, which adds or takes single counts by an offset of states.
; 12 MHz: one machine cycle is 1 us. Cycle numbers count from the cycle in which the lines are read.
; Every other job is cut into pieces with a copy of the lines (PASS) between them. DPTR and R7 belong to the copying.

        .module b
        .include "rtec.inc"

WORD_TOTALS     = 1
GATE            = GATE_B
FAST_COUNTS     = FAST_B
ARMING          = ARMING_B

        .if ONE_CLOCK
; In the line, as a call and its return take as long as the copy. 8 clocks, or 21 with a change, which is out after 15.
        .macro  PASS    ?same
        mov     a,P3
        anl     a,#LINES
        xrl     a,r5                    ; SEEN
        jz      same
        xrl     a,r5
        mov     r5,a
        orl     a,r7                    ; OFFSET
        movc    a,@a+dptr
        mov     P1,a
        setb    F_MOVED
        clr     TR1
        clr     TF1
same:
        .endm
        .else
        .macro  PASS
        lcall   pass                    ; 2, and 6 without a change; A and the carry are lost
        .endm
        .endif
        .macro  DESIGN_START
        mov     dptr,#levels            ; before all else: the controller waits for its lines
        mov     SEEN,#0xFF              ; no levels: the first look copies
        lcall   pass
        .endm
        .include "common.asm"

; Copy the lines if they have changed.
pass:
        mov     a,P3                    ; cycle 0
        anl     a,#LINES                ; cycle 1
        cjne    a,SEEN,passing          ; cycles 2, 3
        ret
passing:
        mov     SEEN,a                  ; cycle 4; by address, as the probe's routine calls this with a bank of its own
        orl     a,OFFSET                ; cycle 5
        movc    a,@a+dptr               ; cycles 6, 7
        mov     P1,a                    ; cycle 8: out, 8 us after the look
        setb    F_MOVED
        jbc     F_HALF,void             ; no insertion after a transition met here: it is the one between,
        setb    F_HALF
        ret
void:   clr     TR1                     ; and where there was one already, what was timed is void
        clr     TF1
        ret

; A reading is over: plan the next insertion, then copy.
work:
        jb      F_OWED,plan
unplanned:
        clr     TR1                     ; TF1 alone says "owed, timed and slow enough" from here on
        clr     TF1
        sjmp    copy
plan:   jb      F_FAST,unplanned
        PASS
        mov     a,#1
        jnb     F_MINUS,ahead
        mov     a,#3
ahead:  add     a,OFFSET
        anl     a,#3
        mov     NEXT_OFFSET,a
        PASS
        jnb     F_REST,copy
        jb      F_MOVED,copy            ; it has just begun to move
        mov     a,r5                    ; at rest there is no transition to wait for: the insertion just starts
        sjmp    insert

copy:   mov     a,P3                    ; cycle 0; a turn without a change takes 6 cycles
        anl     a,#LINES                ; cycle 1
        cjne    a,SEEN,changed          ; cycles 2, 3
        jnb     TF0,copy                ; cycles 4, 5
        ljmp    tick
changed:
        mov     r5,a                    ; cycle 4: SEEN
        orl     a,r7                    ; cycle 5: OFFSET
        movc    a,@a+dptr               ; cycles 6, 7
        mov     P1,a                    ; cycle 8: out, 8 us after the look
        jb      TF1,insert_after        ; cycles 9, 10
        setb    F_MOVED
        jnb     F_OWED,copy
        jnb     TR1,time                ; the first transition: time from here
        jbc     F_HALF,too_fast         ; the period of the exclusive OR is two transitions
        setb    F_HALF
        sjmp    copy
too_fast:
        inc     REFUSED
time:   jb      F_FAST,copy
        .if ONE_CLOCK
        PASS                            ; a transition met here only makes the time longer
        nop
        nop
        nop
        nop
        nop
        .endif
        mov     TL1,#(256 - GATE - ARMING)
        clr     F_HALF
        setb    TR1
        sjmp    copy

insert_after:
        .if ONE_CLOCK
        mov     a,r5
        orl     a,r6
        movc    a,@a+dptr
        mov     P1,a                    ; the step, 11 clocks after the copy
        setb    F_MOVED
        sjmp    stepped
        .endif
        setb    F_MOVED                 ; cycle 11
        mov     a,r5                    ; cycle 12
insert: orl     a,r6                    ; cycle 13: NEXT_OFFSET
        movc    a,@a+dptr               ; cycles 14, 15
        mov     P1,a                    ; cycle 16: the step, 8 us after the copy
stepped:
        mov     OFFSET,NEXT_OFFSET
        PASS_MORE
        clr     TR1
        clr     TF1
        clr     F_HALF
        lcall   book
        ljmp    work

; Levels of port 1 for the levels read (A 10h, B 20h) and the offset 0 to 3. The other pins stay high.
S1 = 0xCF                               ; 00
S2 = 0xCF + LINE_A                      ; 10
S3 = 0xCF + LINE_A + LINE_B             ; 11
S4 = 0xCF + LINE_B                      ; 01
levels:
        .db     S1,S2,S3,S4
        .ds     12
        .db     S2,S3,S4,S1
        .ds     12
        .db     S4,S1,S2,S3
        .ds     12
        .db     S3,S4,S1,S2
