// Design C of NISTIR 4832: inverters in A and B, switched one after the other, add two counts or take two.
//
// The encoder is followed one count at a time. Counts that come while the lines are inverted wait in a counter, the
// hold latch, and are let through afterwards, one by one: the controller never sees two changes too close together.

module design_c #(
    parameter SPACING = 4  // ticks between two changes at the controller; 80 ns at 50 MHz
) (
    input wire clk,
    input wire rst,
    input wire a_in,
    input wire b_in,
    input wire signed [15:0] requested,  // total of steps asked for, of this clock
    output wire a_out,
    output wire b_out,
    output reg signed [15:0] completed  // total of steps inserted
);
    // two flip-flops for each line of the encoder, which knows nothing of this clock, and one to see it change
    reg [1:0] meta, now, last;
    always @(posedge clk) begin
        meta   <= {b_in, a_in};
        now    <= meta;
        last <= now;
    end

    // a line changed: forward where the one that changed is A with A = B before it, or B with A and B different
    wire [1:0] changed = now ^ last;
    wire moved = ^changed;
    wire forward = changed[0] ^ (last[0] ^ last[1]);

    reg signed [4:0] held;  // counts of the encoder that the controller has not seen yet
    reg [1:0] passed;       // {B, A} as far as they are let through
    reg [1:0] inverted;     // {B, A}: which lines are inverted
    reg half;               // the first line of an insertion is inverted, the second is not
    reg second;             // which one comes second: 1 is B
    reg adds;               // the insertion adds counts
    reg [7:0] wait_ticks;

    assign {b_out, a_out} = passed ^ inverted;

    wire signed [16:0] owed = requested - completed;  // one bit more: from one end of the word to the other
    wire equal = passed[0] == passed[1];
    wire b_first = equal ^ (owed > 0);
    wire ready = wait_ticks == 0;
    wire lets_through = ready && !half && held != 0;
    wire starts = ready && !half && held == 0 && owed != 0;
    wire back = held < 0;

    always @(posedge clk)
        if (rst) begin
            held       <= 0;
            passed     <= now;
            inverted   <= 0;
            half       <= 0;
            second     <= 0;
            adds       <= 0;
            wait_ticks <= 0;
            completed  <= 0;
        end else begin
            held <= held + (moved ? (forward ? 5'sd1 : -5'sd1) : 5'sd0)
                         - (lets_through ? (back ? -5'sd1 : 5'sd1) : 5'sd0);
            if (lets_through || starts || (ready && half)) wait_ticks <= SPACING - 1;
            else if (!ready) wait_ticks <= wait_ticks - 1;

            if (lets_through) begin
                // forward from A = B changes A, from A and B different B; backward the other way
                if (equal ^ back) passed[0] <= !passed[0];
                else passed[1] <= !passed[1];
            end else if (starts) begin
                inverted[b_first] <= !inverted[b_first];
                second <= !b_first;
                adds   <= owed > 0;
                half   <= 1;
            end else if (ready && half) begin
                inverted[second] <= !inverted[second];
                completed <= adds ? completed + 1 : completed - 1;
                half      <= 0;
            end
        end
endmodule
