// Plays one stream into a design and writes down what comes out, from power-up on.
// rtec_pins.vh, written for the design, says what its ports are called.
//
// In, a row for each change: its time in ps, 1 for levels (A + 2 * B) or 2 for the total, and the value; before them the
// end of the run, 0, and the levels at power-up, behind them three zeros. Out, rows of six: what it is (0 power-up, 1 change, 2 sign of life,
// 3 end of the run, 4 $finish), time, levels, completed, refused, and which of them are unknown (1 A, 2 B, 4 completed,
// 8 refused).

`timescale 1ps / 1ps
`include "rtec_pins.vh"

module rtec_bench;
    reg clock = 0, reset = 1, a, b, seen = 0;
    reg signed [`RTEC_REQUESTED_BITS-1:0] requested = 0;
    wire a_out, b_out;
    wire signed [`RTEC_COMPLETED_BITS-1:0] completed;
    `RTEC_REFUSED_WIRE

    `RTEC_DESIGN dut (`RTEC_CONNECTIONS);

    // what is printed at the end of an instant has to be a signal of its own
    wire [1:0] levels = {b_out, a_out};
    wire [3:0] unknown = {^refused === 1'bx, ^completed === 1'bx, b_out !== 1'b0 && b_out !== 1'b1,
                          a_out !== 1'b0 && a_out !== 1'b1};
    reg [8*64-1:0] name;
    integer in, out, read, kind;
    reg ended = 0;
    reg signed [63:0] origin, until_ps, change_ps, value, whole_ps, rest, rise_ps, later_ps, now_ps, ticks;

    // all that the design remembers: where it is the same at two ticks in a row, and nothing has come in or gone out
    // between them, it stays so at every later one until something comes in
    reg [`RTEC_MEMORY_BITS-1:0] memory;
    reg signed [127:0] last_tick;
    integer changes = 0, changes_before = 0, quiet = 0, look = 4;

    initial begin
        in = 32'h8000_0000;  // standard input
        read = $value$plusargs("rtec_out=%s", name);
        out = $fopen(name, "w");
        read = $fscanf(in, "%d %d %d", until_ps, kind, value);
        {b, a} = value[1:0];
        change_ps = until_ps;
        rise_ps = `RTEC_PERIOD_NUM / `RTEC_PERIOD_DEN + 1;
        for (ticks = 1; ticks <= `RTEC_TICKS_BEFORE; ticks = ticks + 1) begin
            #(rise_ps / 2) clock = 1;
            #(rise_ps - rise_ps / 2) clock = 0;
            if (ticks == `RTEC_RESET_TICKS) reset <= 0;
        end
        #(rise_ps) origin = $time;
        clock = 1;  // the tick at time 0
        seen = 1;
        $fstrobe(out, "0 0 %0d %0d %0d %0d", levels, completed, refused, unknown);
        fork
            tick;
            change;
            #(until_ps) begin
                ended = 1;
                $fwrite(out, "3 %0d 0 0 0 0\n", until_ps);
                $finish;
            end
        join
    end

    // ticks at k * period, each rounded up to a whole ps for itself: the rest is carried on and never lost
    task tick;
        begin
            whole_ps = 0;
            rest = 0;
            rise_ps = 0;
            ticks = 0;
            forever begin
                later_ps = rise_after(0);
                #(origin + rise_ps + (later_ps - rise_ps) / 2 - $time);
                quiet = changes == changes_before ? quiet + 1 : 0;
                changes_before = changes;
                if (quiet == 0) look = 4;
                last_tick = ticks;
                if (`RTEC_MAY_REST && quiet == look) memory = `RTEC_MEMORY;
                if (`RTEC_MAY_REST && quiet == look + 1) begin
                    look = 2 * look;
                    // on to the last tick before something comes in
                    if (memory === `RTEC_MEMORY) begin
                        last_tick = change_ps - 1;
                        last_tick = last_tick * `RTEC_PERIOD_DEN / `RTEC_PERIOD_NUM;
                    end
                end
                if (last_tick > ticks) begin
                    ticks = last_tick;
                    last_tick = last_tick * `RTEC_PERIOD_NUM;
                    whole_ps = last_tick / `RTEC_PERIOD_DEN;
                    rest = last_tick % `RTEC_PERIOD_DEN;
                    rise_ps = whole_ps + (rest > 0);
                end else begin
                    clock = 0;
                    #(origin + later_ps - $time) clock = 1;
                    rest = rest + `RTEC_PERIOD_NUM % `RTEC_PERIOD_DEN;
                    whole_ps = whole_ps + `RTEC_PERIOD_NUM / `RTEC_PERIOD_DEN + rest / `RTEC_PERIOD_DEN;
                    rest = rest % `RTEC_PERIOD_DEN;
                    rise_ps = later_ps;
                    ticks = ticks + 1;
                    if (ticks % 65536 == 0) begin
                        $fwrite(out, "2 %0d 0 0 0 0\n", rise_ps);
                        $fflush(out);
                    end
                end
            end
        end
    endtask

    // the time of the tick behind this one
    function signed [63:0] rise_after(input unused);
        rise_after = whole_ps + `RTEC_PERIOD_NUM / `RTEC_PERIOD_DEN
                   + (rest + `RTEC_PERIOD_NUM % `RTEC_PERIOD_DEN + `RTEC_PERIOD_DEN - 1) / `RTEC_PERIOD_DEN;
    endfunction

    // behind the tick: what changes with it is seen by the next one
    task change;
        begin
            read = $fscanf(in, "%d %d %d", change_ps, kind, value);
            while (kind != 0) begin
                #(origin + change_ps - $time);
                changes = changes + 1;
                if (kind == 1) {b, a} <= value[1:0];
                else requested <= value;
                read = $fscanf(in, "%d %d %d", change_ps, kind, value);
            end
            change_ps = until_ps;
        end
    endtask

    always @(a_out, b_out, completed, refused)
        if (seen) begin
            now_ps = $time - origin;
            changes = changes + 1;
            $fstrobe(out, "1 %0d %0d %0d %0d %0d", now_ps, levels, completed, refused, unknown);
        end

    final if (!ended && seen) $fwrite(out, "4 %0d 0 0 0 0\n", $time - origin);
endmodule
