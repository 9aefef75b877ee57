// Drives the open path at 500 kHz encoder frequency and prints one line of JSON.
//
//   bench EDGES [SEED [DIRECTION [SPACING]]]      DIRECTION + or -: the sign of the corrections
//
// Edges come 500 ns apart; those of B are late by the phase error (10 degrees of 2 us), every one is off by a
// triangular jitter of at most 5 ns, and all are rounded to the clock of 20 ns. Every SPACING-th edge (100) carries a
// request of one correction of two counts; an odd spacing goes through all states. The stimulus is
// made before the clock starts to count: wall_s and cpu_s (processor time) hold the simulation alone.
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <random>
#include <vector>

#include "Vtop.h"
#include "verilated.h"

namespace {

constexpr double kClockNs = 20.0;
constexpr double kEdgeNs = 500.0;
constexpr double kPhaseErrorNs = 10.0 / 360.0 * 4.0 * kEdgeNs;
constexpr double kJitterNs = 5.0;
constexpr int kSettleClocks = 64;
constexpr int kStepCounts = 2;

// Clocks from each edge to the next one; the last entry lets the path settle.
std::vector<std::uint8_t> clocks_between_edges(std::int64_t edges, std::uint64_t seed) {
    std::mt19937_64 generator(seed);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    std::vector<std::uint8_t> gaps(static_cast<std::size_t>(edges));
    std::int64_t before = 0;
    for (std::int64_t i = 0; i <= edges; ++i) {
        const double jitter = kJitterNs * (uniform(generator) - uniform(generator));
        const double late = (i % 2 != 0) ? kPhaseErrorNs : 0.0;
        const std::int64_t now = std::llround((static_cast<double>(i) * kEdgeNs + late + jitter) / kClockNs);
        if (i > 0) gaps[static_cast<std::size_t>(i - 1)] = static_cast<std::uint8_t>(now - before);
        before = now;
    }
    gaps.back() = kSettleClocks;
    return gaps;
}

}  // namespace

int main(int argc, char** argv) {
    const std::int64_t edges = argc > 1 ? std::atoll(argv[1]) : 2'000'000;
    const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
    const int sign = argc > 3 && argv[3][0] == '-' ? -1 : 1;
    const std::int64_t spacing = argc > 4 ? std::atoll(argv[4]) : 100;
    if (edges < 1 || spacing < 2) {  // the gate refuses at the very first edge: no interval is known there
        std::fputs("bench: EDGES must be a whole number from 1, SPACING one from 2\n", stderr);
        return 2;
    }
    const std::vector<std::uint8_t> gaps = clocks_between_edges(edges, seed);

    const auto context = std::make_unique<VerilatedContext>();
    const auto top = std::make_unique<Vtop>(context.get());
    top->clk = 0;
    top->encoder = 0;
    top->requested = 0;
    top->eval();

    const auto start = std::chrono::steady_clock::now();
    const std::clock_t cpu_start = std::clock();
    std::int64_t encoder_counts = 0;
    std::int32_t requested = 0;
    std::int64_t until_correction = spacing;
    for (const std::uint8_t gap : gaps) {
        top->encoder ^= (encoder_counts % 2 == 0) ? 2 : 1;
        ++encoder_counts;
        if (--until_correction == 0) {
            until_correction = spacing;
            requested += sign;
            top->requested = requested;
        }
        for (unsigned clock = gap; clock != 0; --clock) {
            top->clk = 1;
            top->eval();
            top->clk = 0;
            top->eval();
        }
    }
    const double cpu_s = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

    const std::int64_t controller_counts = static_cast<std::int32_t>(top->count);
    const std::int64_t corrections = static_cast<std::int32_t>(top->completed);
    const bool audit = controller_counts == encoder_counts + kStepCounts * corrections && corrections == requested
                       && top->illegal == 0;
    std::printf(
        "{\"edges\": %lld, \"encoder_counts\": %lld, \"controller_counts\": %lld, \"corrections\": %lld, "
        "\"corrections_requested\": %d, \"illegal\": %u, \"gated\": %u, \"audit\": %s, \"wall_s\": %.6f, "
        "\"cpu_s\": %.6f, \"edges_per_s\": %.0f}\n",
        static_cast<long long>(edges), static_cast<long long>(encoder_counts),
        static_cast<long long>(controller_counts), static_cast<long long>(corrections), requested,
        static_cast<unsigned>(top->illegal), static_cast<unsigned>(top->gated), audit ? "true" : "false", wall_s, cpu_s,
        static_cast<double>(edges) / wall_s);
    return audit ? 0 : 1;
}
