"""A cocotb test: what the bench records of streams, written down for the process that began the simulation."""

import json
import os
from pathlib import Path

import cocotb
from cocotb.clock import Clock

from rtec.cocotb import Bench, hold
from rtec.errors import RtecError
from rtec.injector import Design
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.streams import Stream
from rtec.verify.contract.verilog_pins import Pins

ASKED = json.loads(os.environ.get("RTEC_ASKED", "{}"))


@cocotb.test()
async def answer(dut):
    """Do what was asked for with each pins file, and write down what came of it."""
    Clock(dut.clk, ASKED["period_ns"], "ns").start()
    answers = []
    for file in ASKED["pins"]:
        try:
            answers.append(await answer_of(dut, Pins.read(Path(file))))
        except (AssertionError, RtecError) as error:
            answers.append(f"{type(error).__name__}: {error}")
    Path(ASKED["answer"]).write_text(json.dumps(answers))


async def answer_of(dut, pins):
    """Return the responses to the streams, or hold the module to its contract."""
    if not ASKED.get("streams"):
        return await hold(dut, pins, Contract.of(Design.C))
    bench = Bench(dut, pins)
    responses = [await bench.run(Stream.read(text).stimulus()) for text in ASKED["streams"]]
    return [
        [
            response.edges.initial,
            response.edges.times_ps.tolist(),
            response.edges.levels.tolist(),
            response.completed.times_ps.tolist(),
            response.completed.totals.tolist(),
            None if response.broken is None else [response.broken.time_ps, response.broken.reason],
        ]
        for response in responses
    ]
