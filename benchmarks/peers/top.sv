// The open path: encoder lines, design C, the controller's receiver, all on one clock of 50 MHz.
module top (
    input  logic               clk,
    input  logic        [1:0]  encoder,  // {A, B}
    input  logic signed [31:0] requested,
    output logic signed [31:0] completed,
    output logic        [31:0] gated,
    output logic signed [31:0] count,
    output logic        [31:0] illegal
);
    logic [1:0] line;

    design_c     corrector (.clk, .encoder, .requested, .completed, .gated, .line);
    quad_decoder receiver (.clk, .line, .count, .illegal);
endmodule
