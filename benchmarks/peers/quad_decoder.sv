// The controller's receiver: two-stage synchroniser, digital filter (a line follows once three samples in a row
// agree, 60 ns at 50 MHz) and x4 decoder. Counts in the order 00, 10, 11, 01 of {A, B} are positive; a change of both
// lines in one clock is an illegal transition and leaves the count alone.
module quad_decoder (
    input  logic               clk,
    input  logic        [1:0]  line,  // {A, B}
    output logic signed [31:0] count,
    output logic        [31:0] illegal
);
    logic [1:0] meta, sample, sample_1, sample_2, level, level_before;

    wire [1:0] steady  = ~((sample ^ sample_1) | (sample ^ sample_2));
    wire [1:0] changed = level ^ level_before;

    initial begin
        meta         = 2'b00;
        sample       = 2'b00;
        sample_1     = 2'b00;
        sample_2     = 2'b00;
        level        = 2'b00;
        level_before = 2'b00;
        count        = 32'sd0;
        illegal      = 32'd0;
    end

    always_ff @(posedge clk) begin
        meta         <= line;
        sample       <= meta;
        sample_1     <= sample;
        sample_2     <= sample_1;
        level        <= (level & ~steady) | (sample & steady);
        level_before <= level;
        if (changed == 2'b11) illegal <= illegal + 32'd1;
        else if (changed != 2'b00) begin
            if (level[1] != level_before[0]) count <= count + 32'sd1;
            else count <= count - 32'sd1;
        end
    end
endmodule
