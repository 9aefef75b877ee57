"""Verilog modules for tests: what they do follows from a few lines each, so that the tests can say it in Python."""

PORTS = "input wire clk, input wire a, input wire b, input wire signed [15:0] asked"
PINS = {
    "clock": "clk", "a_in": "a", "b_in": "b", "requested": "asked", "a_out": "qa", "b_out": "qb", "completed": "done"
}  # fmt: skip

WIRES = f"""
module wires({PORTS}, output wire qa, output wire qb, output wire signed [15:0] done);
    assign qa = a;
    assign qb = b;
    assign done = 0;
endmodule
"""

SAMPLER = f"""
// takes A and B over at each tick, and counts 4096 ticks at a time
module sampler({PORTS}, output reg qa, output reg qb, output reg signed [15:0] done);
    reg [11:0] ticks = 0;
    initial done = -1;  // the ticks before time 0 are less than 4096
    always @(posedge clk) begin
        qa <= a;
        qb <= b;
        if (asked == 1) begin
            ticks <= ticks + 1;
            if (ticks == 0) done <= done + 1;
        end else begin
            ticks <= 0;
            done <= 0;
        end
    end
endmodule
"""

MODES = f"""
// what is asked for chooses what goes wrong
module modes({PORTS}, output wire qa, output wire qb, output reg signed [15:0] done, output wire [3:0] no);
    reg open;  // nothing sets it
    reg [31:0] n = 0;
    wire loop = (asked == 3) & ~loop;
    assign qa = a ^ loop;
    assign qb = b;
    assign no = asked == 7 ? 4'd9 : n[31:28];
    always @(posedge clk) begin
        done <= 0;
        if (asked == 1) $finish;
        while (asked == 2) n = n + 1;
        if (asked == 4) done <= {{15'd0, open}};
        if (asked == 5) done <= $time > 64'd90_000_000 ? 5 : 0;
        if (asked == 6) $display("said at every tick");
    end
endmodule
"""


def pins_text(top: str, **more: str) -> str:
    """Return a pins file for one of these modules."""
    given = {"top": top, **PINS, **more}
    return "".join(f'{key} = "{value}"\n' for key, value in given.items() if value)
