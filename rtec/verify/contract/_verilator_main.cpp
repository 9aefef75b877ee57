// Plays streams into a design and writes down what comes out; each run is a new model, from power-up on.
// rtec_pins.h, written for the design, says what its ports are called.
//
// In, int64: how many numbers follow; then for each stream its end in ps, the levels at power-up (A + 2 * B), the number
// of changes, and of each change its time, 1 for levels or 2 for the total, and the value. Out, three plays of each as
// rows of six int64: what it is (0 power-up, 1 change, 2 sign of life, 3 end of the run, 4 $finish, 5 ended from outside,
// 6 all streams played), time, levels, completed, refused, 0. What the design prints goes to the standard error.

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>
#include <sys/resource.h>
#include <unistd.h>
#include "Vdut.h"
#include "Vdut__Syms.h"
#include "verilated.h"
#include "rtec_pins.h"

typedef int64_t i64;
typedef __int128 i128;

static int out_file;
static std::vector<i64> rows;
static volatile i64 now_ps;

double sc_time_stamp() { return static_cast<double>(now_ps); }

static void flush_rows() {
    const char* from = reinterpret_cast<const char*>(rows.data());
    size_t left = rows.size() * sizeof(i64);
    while (left > 0) {
        const ssize_t written = write(out_file, from, left);
        if (written <= 0) _exit(3);
        from += written;
        left -= static_cast<size_t>(written);
    }
    rows.clear();
}

static void ended(int number) {
    const i64 row[6] = {5, now_ps, 0, 0, 0, 0};
    if (write(out_file, rows.data(), rows.size() * sizeof(i64)) < 0 || write(out_file, row, sizeof row) < 0) _exit(3);
    _exit(number == SIGTERM || number == SIGXFSZ ? 4 : 5);
}

struct Seen {
    i64 levels, completed, refused;
    explicit Seen(const Vdut& dut)
        : levels((dut.RTEC_A_OUT & 1) + 2 * (dut.RTEC_B_OUT & 1)),
          completed(static_cast<i64>(static_cast<uint64_t>(dut.RTEC_COMPLETED) << (64 - RTEC_COMPLETED_BITS)) >>
                    (64 - RTEC_COMPLETED_BITS)),
          refused(RTEC_REFUSED(dut)) {}
    bool operator!=(const Seen& other) const {
        return levels != other.levels || completed != other.completed || refused != other.refused;
    }
};

static void add_row(i64 kind, i64 t_ps, const Seen& seen) {
    rows.insert(rows.end(), {kind, t_ps, seen.levels, seen.completed, seen.refused, 0});
}

static void set_levels(Vdut& dut, i64 levels) {
    dut.RTEC_A_IN = levels & 1;
    dut.RTEC_B_IN = (levels >> 1) & 1;
}

// All that a design remembers. Where it is the same at two ticks in a row, and nothing has come in or gone out between
// them, it stays so at every later one until something comes in: the ticks up to there need not be played.
class Memory {
    std::vector<unsigned char> bytes;

public:
    void take(const Vdut& dut) {
        bytes.resize(sizeof(Vdut__Syms));
        std::memcpy(bytes.data(), static_cast<const void*>(dut.rootp->vlSymsp), bytes.size());
    }
    bool same(const Vdut& dut) const {
        return std::memcmp(bytes.data(), static_cast<const void*>(dut.rootp->vlSymsp), bytes.size()) == 0;
    }
};

static void play(const std::vector<i64>& in, size_t at, int power_up) {
    VerilatedContext context;
    context.randReset(power_up);  // registers that the design leaves open: all 0, all 1, at random
    context.randSeed(1993);
    context.fatalOnError(false);
    Vdut dut(&context);
    const i64 until_ps = in[at];
    i64 next = static_cast<i64>(at) + 3;
    const i64 past = next + 3 * in[at + 2];
    now_ps = 0;
    dut.RTEC_CLOCK = 0;
    set_levels(dut, in[at + 1]);
    dut.RTEC_REQUESTED = 0;
    RTEC_RESET(dut, true);
    dut.eval();
    for (int tick = 0; tick < RTEC_TICKS_BEFORE; ++tick) {
        dut.RTEC_CLOCK = 1;
        dut.eval();
        dut.RTEC_CLOCK = 0;
        if (tick + 1 == RTEC_RESET_TICKS) RTEC_RESET(dut, false);
        dut.eval();
    }
    dut.RTEC_CLOCK = 1;  // the tick at time 0
    dut.eval();
    Seen last(dut);
    add_row(0, 0, last);

    // ticks at k * period, each rounded up to a whole ps for itself: the rest is carried on and never lost
    i64 whole_ps = 0, rest = 0;
    const auto next_rise = [&]() {
        whole_ps += RTEC_PERIOD_NUM / RTEC_PERIOD_DEN;
        rest += RTEC_PERIOD_NUM % RTEC_PERIOD_DEN;
        if (rest >= RTEC_PERIOD_DEN) {
            rest -= RTEC_PERIOD_DEN;
            ++whole_ps;
        }
        return whole_ps + (rest > 0);
    };
    i64 rise_ps = next_rise(), fall_ps = rise_ps / 2, ticks = 0;
    Memory memory;
    const i64 first_look = 4;  // ticks without a change; then twice as many, and so on
    i64 changes = 0, changes_before = 0, quiet = 0, look = first_look;
    auto told = std::chrono::steady_clock::now();
    while (!context.gotFinish()) {
        i64 t_ps = fall_ps < rise_ps ? fall_ps : rise_ps;
        if (next < past && in[next] < t_ps) t_ps = in[next];
        if (t_ps >= until_ps) break;
        now_ps = t_ps;
        context.time(t_ps);
        if (t_ps == fall_ps) {
            dut.RTEC_CLOCK = 0;
            dut.eval();
            fall_ps = INT64_MAX;
        } else if (t_ps == rise_ps) {
            dut.RTEC_CLOCK = 1;
            dut.eval();
            const i64 before_ps = rise_ps;
            rise_ps = next_rise();
            fall_ps = before_ps + (rise_ps - before_ps) / 2;
            if (++ticks % 4096 == 0 && std::chrono::steady_clock::now() - told > std::chrono::seconds(1)) {
                told = std::chrono::steady_clock::now();
                add_row(2, t_ps, last);
                flush_rows();
            }
            quiet = changes == changes_before ? quiet + 1 : 0;
            changes_before = changes;
            if (quiet == 0) look = first_look;
            if (RTEC_MAY_REST && quiet == look) {
                memory.take(dut);
            } else if (RTEC_MAY_REST && quiet == look + 1) {
                look *= 2;
                if (memory.same(dut)) {  // on to the last tick before something comes in
                    const i64 until = next < past && in[next] < until_ps ? in[next] : until_ps;
                    const i128 last_tick = static_cast<i128>(until - 1) * RTEC_PERIOD_DEN / RTEC_PERIOD_NUM;
                    if (last_tick > ticks) {
                        ticks = static_cast<i64>(last_tick);
                        whole_ps = static_cast<i64>(last_tick * RTEC_PERIOD_NUM / RTEC_PERIOD_DEN);
                        rest = static_cast<i64>(last_tick * RTEC_PERIOD_NUM % RTEC_PERIOD_DEN);
                        const i64 risen_ps = whole_ps + (rest > 0);
                        rise_ps = next_rise();
                        fall_ps = risen_ps + (rise_ps - risen_ps) / 2;
                        continue;
                    }
                }
            }
        }
        if (next < past && in[next] == t_ps) {  // behind the tick: what changes with it is seen by the next one
            ++changes;
            for (; next < past && in[next] == t_ps; next += 3) {
                if (in[next + 1] == 1) {
                    set_levels(dut, in[next + 2]);
                } else {
                    dut.RTEC_REQUESTED = static_cast<uint64_t>(in[next + 2]) & ((uint64_t{1} << RTEC_REQUESTED_BITS) - 1);
                }
            }
            dut.eval();
        }
        const Seen seen(dut);
        if (seen != last) {
            ++changes;
            add_row(1, t_ps, seen);
            last = seen;
        }
    }
    add_row(context.gotFinish() ? 4 : 3, context.gotFinish() ? now_ps : until_ps, last);
    flush_rows();
}

int main() {
    out_file = dup(1);
    dup2(2, 1);
    const rlimit most_said = {50000000, 50000000};
    setrlimit(RLIMIT_FSIZE, &most_said);
    rows.reserve(1 << 20);
    for (const int number : {SIGTERM, SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL, SIGXFSZ}) signal(number, ended);
    std::vector<i64> in;
    for (i64 size; fread(&size, sizeof size, 1, stdin) == 1;) {
        in.resize(static_cast<size_t>(size));
        if (fread(in.data(), sizeof(i64), in.size(), stdin) != in.size()) return 2;
        for (size_t at = 0; at < in.size(); at += 3 + 3 * static_cast<size_t>(in[at + 2])) {
            for (const int power_up : {0, 1, 2}) play(in, at, power_up);
        }
        rows.insert(rows.end(), {6, 0, 0, 0, 0, 0});
        flush_rows();
    }
    return 0;
}
