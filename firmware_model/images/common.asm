; What all four designs share: vectors, start-up, position, the handshake with the PC, totals.
; An image defines before it includes this file: the macro PASS, the macro DESIGN_START, WORD_TOTALS (1: totals of two
; bytes), GATE and FAST_COUNTS; and the label `work`, where its own part begins after each reading.
; PASS stands wherever A and the carry hold nothing: Design B copies its lines there, for the others it is empty.
; PASS_MORE is a PASS of the one-clock parts alone, whose calls and branches weigh more; it has to keep the carry.

        .macro  PASS_MORE
        .if ONE_CLOCK
        PASS
        .endif
        .endm

        .area   CODE (ABS)
        .org    0x0000
        ljmp    start
        .org    0x000B
        ljmp    break_out               ; timer 0, enabled in the searching loops only
        .org    0x0013
        ljmp    probe_trip              ; INT1
        .org    0x0030

; --- start-up -------------------------------------------------------------------------------------------------------
start:
        mov     SP,#STACK
        mov     r0,#STACK
clear:  mov     @r0,#0                  ; all variables, the register banks with them
        djnz    r0,clear
        mov     0x09,#DECODER_LOW       ; R1 of bank 1; its R0 is DECODER_HIGH = 0
        DESIGN_START
        mov     MESSAGE,#NOT_HOMED
        mov     TMOD,#0x21              ; timer 0: 16 bits; timer 1: 8 bits, the speed gate
        setb    IT0                     ; IE0 remembers a falling edge on P3.2; it never interrupts
        setb    IT1
        setb    PX1                     ; the probe goes before the tick
        setb    EX1
        lcall   zero_position
        setb    EA

; --- every tick: position, request, answer ---------------------------------------------------------------------------
tick:
        clr     ET0
        clr     TR0
        mov     TL0,#<(0x10000 - TICK + TICK_LOST)
        mov     TH0,#>(0x10000 - TICK + TICK_LOST)
        clr     TF0
        setb    TR0
        PASS
        lcall   read_position
        PASS
        lcall   read_request
        PASS
        lcall   judge
        PASS
        lcall   owe
        PASS
        lcall   place_trip
        PASS
        lcall   publish
        PASS
        clr     F_REST
        jbc     IE0,unseen
        jb      F_MOVED,settled
        mov     a,DELTA_LOW
        orl     a,DELTA_HIGH
        jnz     settled
        setb    F_REST
        sjmp    settled
unseen: clr     F_TIMED                 ; a transition went by during this: what was timed before it is void
settled:
        clr     F_MOVED
        PASS_MORE
        ljmp    work

; Timer 0 ends a search: nothing has been decided there yet, so the place it came from is dropped.
break_out:
        mov     SP,#STACK
        acall   end_of_interrupt
        ljmp    tick
end_of_interrupt:
        reti

; --- position --------------------------------------------------------------------------------------------------------
zero_position:
        clr     DECODER_RST_N
        clr     a
        mov     RAW_LOW,a
        mov     RAW_HIGH,a
        mov     POSITION,a
        mov     POSITION+1,a
        mov     POSITION+2,a
        setb    DECODER_RST_N
        ret

; Take the decoder's 12 bits and carry the difference from the last reading over to 24 bits.
read_position:
        mov     r0,#DECODER_HIGH
        clr     EA                      ; the probe must not read between the two bytes
        movx    a,@r0
        mov     r3,a
        inc     r0
        movx    a,@r0
        setb    EA
        mov     r2,a
        PASS
        mov     a,r2
        clr     c
        subb    a,RAW_LOW
        mov     DELTA_LOW,a
        mov     a,r3
        subb    a,RAW_HIGH
        anl     a,#0x0F                 ; modulo 4096 ...
        jnb     ACC+3,forward
        orl     a,#0xF0                 ; ... and signed
forward:
        mov     DELTA_HIGH,a
        PASS
        mov     RAW_LOW,r2
        mov     RAW_HIGH,r3
        mov     a,DELTA_HIGH
        rlc     a
        subb    a,ACC                   ; sign: 0 or FFh
        mov     r4,a
        PASS_MORE
        mov     a,DELTA_LOW
        add     a,POSITION
        mov     POSITION,a
        mov     a,DELTA_HIGH
        addc    a,POSITION+1
        mov     POSITION+1,a
        mov     a,r4
        addc    a,POSITION+2
        mov     POSITION+2,a
        PASS
        mov     a,r4                    ; |difference| beyond the gate's speed? The complement is one less than the
        cpl     a                       ; magnitude, so only a positive difference borrows one
        rlc     a
        mov     a,DELTA_LOW
        xrl     a,r4
        subb    a,#<FAST_COUNTS
        PASS_MORE
        mov     a,DELTA_HIGH
        xrl     a,r4
        subb    a,#>FAST_COUNTS
        cpl     c
        mov     F_FAST,c
        ret

; INT1: the first MOVX closes the decoder's inhibit latch, 8 cycles into this routine. Bank 1 belongs to it.
probe_trip:
        push    ACC                     ; 2
        push    PSW                     ; 2
        mov     PSW,#0x08               ; 2: bank 1 (a byte write: ucsim 0.6.4 does not see SETB RS0)
        movx    a,@r0                   ; 2
        mov     r2,a
        .if ONE_CLOCK
        .else
        PASS                            ; a one-clock part is back before it would matter
        .endif
        movx    a,@r1
        mov     r3,a
        setb    F_TRIPPED
        pop     PSW
        pop     ACC
        reti

; Trip position = position + signed difference of the trip's reading from the last one.
place_trip:
        jnb     F_TRIPPED,no_trip
        clr     F_TRIPPED
        mov     a,TRIP_RAW_LOW
        clr     c
        subb    a,RAW_LOW
        mov     r2,a
        mov     a,TRIP_RAW_HIGH
        subb    a,RAW_HIGH
        anl     a,#0x0F
        jnb     ACC+3,trip_ahead
        orl     a,#0xF0
trip_ahead:
        mov     r3,a
        PASS
        mov     a,r3
        rlc     a
        subb    a,ACC
        mov     r4,a
        mov     a,r2
        add     a,POSITION
        mov     TRIP,a
        mov     a,r3
        addc    a,POSITION+1
        mov     TRIP+1,a
        mov     a,r4
        addc    a,POSITION+2
        mov     TRIP+2,a
        inc     TRIPS
        PASS
no_trip:
        ret

; --- the PC's words --------------------------------------------------------------------------------------------------
read_request:
        mov     r0,#PC_STATUS
        movx    a,@r0
        mov     STATUS,a
        mov     r0,#REQUEST_LOW
        movx    a,@r0
        mov     r2,a
        .if WORD_TOTALS
        PASS
        mov     r0,#REQUEST_HIGH
        movx    a,@r0
        mov     r3,a
        PASS_MORE
        mov     r0,#REQUEST_LOW
        movx    a,@r0
        xrl     a,r2
        jnz     torn                    ; the PC wrote between the bytes: keep the last total until the next reading
        .else
        rlc     a
        subb    a,ACC
        mov     r3,a
        .endif
        mov     REQUESTED_LOW,r2
        mov     REQUESTED_HIGH,r3
torn:   ret

; Decide what the request means; the answer goes into MESSAGE.
judge:
        mov     a,STATUS
        mov     c,ACC+PROBING
        mov     F_PROBING,c
        .if ONE_CLOCK
        PASS
        mov     a,STATUS
        .endif
        jb      F_FATAL,judged          ; for good: only a reset ends it
        jb      F_HOMED,homed
        jnb     ACC+GO_HOME,judged
        mov     a,REQUESTED_LOW
        orl     a,REQUESTED_HIGH
        jnz     judged                  ; home is taken with a request of zero alone
        PASS_MORE
        lcall   zero_position
        PASS_MORE
        setb    F_HOMED
        mov     ACCEPTED,COMPLETED
        mov     ACCEPTED+1,COMPLETED+1
        mov     MESSAGE,#OK
judged: ret
homed:  jb      ACC+GO_HOME,judged      ; a command, with no total to believe
        PASS_MORE
        jnb     F_PROBING,not_probing
        mov     MESSAGE,#IN_PROBING
        ret
not_probing:
        jnb     ENABLE_N,believe
        mov     MESSAGE,#OK
        mov     a,REQUESTED_LOW
        orl     a,REQUESTED_HIGH
        jz      judged
        mov     MESSAGE,#DISABLED
        ret

; The window: -3 to +3 from what was accepted last, or anything with Large Correction.
believe:
        PASS
        clr     c
        mov     a,REQUESTED_LOW
        subb    a,ACCEPTED
        mov     r2,a
        mov     a,REQUESTED_HIGH
        subb    a,ACCEPTED+1
        mov     r3,a
        PASS
        mov     a,r2
        orl     a,r3
        jz      believed                ; no change
        mov     a,r2
        add     a,#WINDOW
        mov     r2,a
        clr     a
        addc    a,r3
        mov     r3,a
        PASS
        mov     a,r3
        jnz     beyond
        mov     a,r2
        add     a,#(255 - 2 * WINDOW)
        jnc     accept
beyond: PASS
        mov     a,STATUS
        jb      ACC+LARGE_CORRECTION,accept
        mov     MESSAGE,#I_DONT_BELIEVE_YOU
        inc     DOUBTS
        PASS_MORE
        mov     a,DOUBTS
        add     a,#(255 - GRACE)
        jnc     doubted
        mov     MESSAGE,#I_STILL_DONT_BELIEVE_YOU
        setb    F_FATAL
doubted:
        ret
accept: mov     ACCEPTED,REQUESTED_LOW
        mov     ACCEPTED+1,REQUESTED_HIGH
        PASS
believed:
        mov     DOUBTS,#0
        mov     MESSAGE,#OK
        ret

; --- totals ----------------------------------------------------------------------------------------------------------
; Is an insertion owed, of which sign, and may it be made?
owe:
        clr     F_OWED
        jb      F_FATAL,owed_none
        jnb     F_HOMED,owed_none
        jb      F_PROBING,owed_none
        jb      ENABLE_N,owed_none
        PASS
        clr     c
        mov     a,ACCEPTED
        subb    a,COMPLETED
        mov     r2,a
        PASS_MORE
        mov     a,ACCEPTED+1
        subb    a,COMPLETED+1
        mov     c,ACC+7
        mov     F_MINUS,c
        orl     a,r2
        jz      owed_none
        setb    F_OWED
        PASS
owed_none:
        PASS_MORE
        ret

; Book the insertion just made and report it at once; then see what is owed still.
book:
        PASS
        mov     r2,#1
        mov     r3,#0
        jnb     F_MINUS,upwards
        mov     r2,#0xFF
        mov     r3,#0xFF
upwards:
        PASS_MORE
        mov     a,r2
        add     a,COMPLETED
        mov     COMPLETED,a
        mov     a,r3
        addc    a,COMPLETED+1
        mov     COMPLETED+1,a
        PASS
        setb    NOT_VALID
        PASS_MORE
        mov     r0,#COMPLETED_LOW
        mov     a,COMPLETED
        movx    @r0,a
        inc     r0
        mov     a,COMPLETED+1
        movx    @r0,a
        clr     NOT_VALID
        PASS
        ljmp    owe

; All words to the PC, with Data Valid low while they change.
        .macro  PUT     word
        mov     a,word
        movx    @r0,a
        inc     r0
        .endm
publish:
        setb    NOT_VALID
        mov     r0,#POSITION_LOW
        PASS_MORE
        PUT     POSITION
        PUT     POSITION+1
        PASS
        PUT     POSITION+2
        PUT     COMPLETED
        PASS
        PUT     COMPLETED+1
        PUT     ACCEPTED
        PASS
        PUT     ACCEPTED+1
        PUT     MESSAGE
        PASS
        PUT     TRIP
        PUT     TRIP+1
        PASS
        PUT     TRIP+2
        PUT     TRIPS
        PASS
        PUT     REFUSED
        clr     NOT_VALID
        ret
