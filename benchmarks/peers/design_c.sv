// Design C of the Real-Time Error Corrector (NISTIR 4832, "Alternate RTEC Design C") with timing like rtec's profile
// "fast": an inverter in A and one in B. A = B: A then B adds two counts, B then A takes two away; A != B: the other
// way round. The first inversion follows a real transition by STEP_CLOCKS, the second one the first.
//
// Transitions are seen on A xor B after a two-stage synchroniser. The gate refuses to insert where the last interval
// between them was shorter than GATE_CLOCKS. Without a transition for REST_CLOCKS the axis counts as at rest and the
// insertion goes ahead.
module design_c #(
    parameter int STEP_CLOCKS = 6,      // 120 ns at 50 MHz
    parameter int GATE_CLOCKS = 18,     // 360 ns: both inversions, the decoder's filter and 60 ns to spare
    parameter int REST_CLOCKS = 50_000  // 1 ms
) (
    input  logic               clk,
    input  logic        [1:0]  encoder,    // {A, B}
    input  logic signed [31:0] requested,  // running totals, in steps of two counts
    output logic signed [31:0] completed,
    output logic        [31:0] gated,      // transitions at which the gate refused
    output logic        [1:0]  line
);
    localparam int SEEN_CLOCKS = 3;  // a transition is acted on in the third clock: synchroniser and register

    typedef enum logic [1:0] {IDLE, FIRST, SECOND} phase_t;

    logic signed [31:0] wanted;
    logic [1:0]  meta, seen, inverted, second_line;
    logic        unequal_before;
    logic [15:0] interval;
    logic [7:0]  timer;
    phase_t      phase;
    logic        minus;

    wire unequal    = ^seen;
    wire transition = unequal != unequal_before;
    wire pending    = wanted != completed;
    wire adds       = wanted > completed;

    assign line = encoder ^ inverted;

    initial begin
        meta           = 2'b00;
        seen           = 2'b00;
        unequal_before = 1'b0;
        inverted       = 2'b00;
        second_line    = 2'b00;
        interval       = 16'd0;
        timer          = 8'd0;
        phase          = IDLE;
        minus          = 1'b0;
        wanted         = 32'sd0;
        completed      = 32'sd0;
        gated          = 32'd0;
    end

    always_ff @(posedge clk) begin
        wanted         <= requested;
        meta           <= encoder;
        seen           <= meta;
        unequal_before <= unequal;
        if (transition) interval <= 16'd1;
        else if (interval != 16'(REST_CLOCKS)) interval <= interval + 16'd1;

        if (phase == IDLE) begin
            if (pending && transition && interval < 16'(GATE_CLOCKS)) gated <= gated + 32'd1;
            else if (pending && (transition || interval == 16'(REST_CLOCKS))) begin
                phase       <= FIRST;
                timer       <= 8'(STEP_CLOCKS - SEEN_CLOCKS - 1);
                minus       <= !adds;
                second_line <= (adds != unequal) ? 2'b01 : 2'b10;
            end
        end else if (timer != 8'd0) timer <= timer - 8'd1;
        else if (phase == FIRST) begin
            inverted <= inverted ^ ~second_line;
            phase    <= SECOND;
            timer    <= 8'(STEP_CLOCKS - 1);
        end else begin
            inverted  <= inverted ^ second_line;
            phase     <= IDLE;
            completed <= minus ? completed - 32'sd1 : completed + 32'sd1;
        end
    end
endmodule
