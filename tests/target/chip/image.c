/* A program for a Cortex-M4 in an emulator: it does the jobs of a file, and writes their results into another one. The emulator's
 * semihosting gives files; there is no other peripheral in it. */
#include <stddef.h>
#include <stdint.h>

#include "jobs.h"

#define CPACR (*(volatile uint32_t *)0xE000ED88u)
#define FPDSCR (*(volatile uint32_t *)0xE000EF3Cu)
#define FPU_ON (0xFu << 20)
#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)
#define SYST_RUNS 5u /* by the processor's clock, without an interrupt */
#define SYST_ALL 0xFFFFFFu
#define PAINT 0xC5C5C5C5u
#define IN_USE 64u /* words of the stack that the program may be in while it paints */

enum { OPEN = 0x01, WRITE = 0x05, READ = 0x06, EXIT = 0x18 };
enum { TO_READ = 1, TO_WRITE = 5, ENDED = 0x20026 };

/* What comes before the rows of a job. */
struct order {
    uint32_t job;   /* place in the table */
    uint32_t setup; /* bytes */
    uint32_t rows;
    uint32_t fpscr; /* of the processor, for this job */
};

/* What the counted steps of a job took. */
struct cost {
    uint32_t stack; /* bytes, with what called the step */
    uint32_t empty; /* ticks of the clock of a step with nothing in it */
    uint32_t steps; /* places of `ticks` that are used */
};

/* Memory that an emulated board has beside the chip's. */
#define SETUP ((uint8_t *)0x21000000u)
#define STATE ((uint8_t *)0x21010000u)
#define ROWS ((struct job_row *)0x21100000u)
#define RESULTS ((union job_result *)0x21800000u)
#define TICKS ((uint32_t *)0x21080000u)
#define TICKS_MAX 65536u

extern uint32_t stack_start[];
extern uint32_t stack_end[];

static struct cost cost;
static uint32_t began;

void reset(void);
void serve(void);
void *memcpy(void *restrict to, const void *restrict from, size_t length);
void *memset(void *to, int value, size_t length);

/* Objects of the law are whole words; eight at once are two instructions. */
void *memcpy(void *restrict to, const void *restrict from, size_t length)
{
    uint32_t *out = to;
    const uint32_t *in = from;
    size_t words = length / sizeof *out;
    for (; words >= 8u; words -= 8u, in += 8, out += 8) {
        const uint32_t a = in[0], b = in[1], c = in[2], d = in[3], e = in[4], f = in[5], g = in[6], h = in[7];
        out[0] = a, out[1] = b, out[2] = c, out[3] = d, out[4] = e, out[5] = f, out[6] = g, out[7] = h;
    }
    for (; words > 0u; words--) {
        *out++ = *in++;
    }
    for (size_t i = length - length % sizeof *out; i < length; i++) {
        ((uint8_t *)to)[i] = ((const uint8_t *)from)[i];
    }
    return to;
}

void *memset(void *to, int value, size_t length)
{
    uint8_t *out = to;
    for (size_t i = 0; i < length; i++) {
        out[i] = (uint8_t)value;
    }
    return to;
}

static int32_t ask(uint32_t what, const void *arguments)
{
    register uint32_t r0 __asm__("r0") = what;
    register const void *r1 __asm__("r1") = arguments;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return (int32_t)r0;
}

static uint32_t opened(const char *name, uint32_t length, uint32_t mode)
{
    const uint32_t arguments[3] = {(uint32_t)name, mode, length};
    return (uint32_t)ask(OPEN, arguments);
}

/* Whether all of it was there. */
static int transferred(uint32_t what, uint32_t file, const void *at, uint32_t length)
{
    const uint32_t arguments[3] = {file, (uint32_t)at, length};
    return ask(what, arguments) == 0;
}

void job_counts(void)
{
    began = SYST_CVR;
}

void job_counted(void)
{
    const uint32_t ticks = (began - SYST_CVR) & SYST_ALL;
    if (cost.steps < TICKS_MAX) {
        TICKS[cost.steps] = ticks;
        cost.steps++;
    }
}

static __attribute__((noinline)) void paint(void)
{
    const uint32_t *end = (const uint32_t *)__builtin_frame_address(0) - IN_USE;
    for (uint32_t *at = stack_start; at < end; at++) {
        *at = PAINT;
    }
}

static uint32_t stack_used(void)
{
    const uint32_t *at = stack_start;
    while (at < stack_end && *at == PAINT) {
        at++;
    }
    return (uint32_t)(stack_end - at) * (uint32_t)sizeof *at;
}

static void perform(const struct order *order)
{
    static job *const jobs[] = {r1_job, friction_job, cycle_job};
    memset(STATE, 0, JOB_STATE_BYTES);
    job_counts();
    cost.steps = 0;
    job_counted();
    cost.empty = TICKS[0];
    cost.steps = 0;
    paint();
    __asm__ volatile("vmsr fpscr, %0" : : "r"(order->fpscr));
    jobs[order->job](SETUP, STATE, ROWS, RESULTS, order->rows);
    __asm__ volatile("vmsr fpscr, %0" : : "r"(0));
    cost.stack = stack_used();
}

__attribute__((noinline)) void serve(void)
{
    const uint32_t in = opened("orders.bin", 10u, TO_READ);
    const uint32_t out = opened("results.bin", 11u, TO_WRITE);
    const uint32_t costs = opened("costs.bin", 9u, TO_WRITE);
    struct order order;
    SYST_RVR = SYST_ALL;
    SYST_CVR = 0;
    SYST_CSR = SYST_RUNS;
    while (transferred(READ, in, &order, sizeof order) && transferred(READ, in, SETUP, order.setup) &&
           transferred(READ, in, ROWS, order.rows * (uint32_t)sizeof *ROWS)) {
        perform(&order);
        (void)transferred(WRITE, out, RESULTS, order.rows * JOB_RESULTS * (uint32_t)sizeof *RESULTS);
        (void)transferred(WRITE, costs, &cost, sizeof cost);
        (void)transferred(WRITE, costs, TICKS, cost.steps * (uint32_t)sizeof *TICKS);
    }
    (void)ask(EXIT, (const void *)ENDED);
}

/* Nothing before the floating-point unit is on may use it. */
void reset(void)
{
    CPACR |= FPU_ON;
    __asm__ volatile("dsb\n\tisb");
    FPDSCR = 0; /* numbers below the normal ones are not flushed to 0 */
    serve();
    for (;;) {
    }
}

extern const void *const vectors[];
const void *const vectors[] __attribute__((section(".vectors"), used)) = {stack_end, (const void *)reset};
