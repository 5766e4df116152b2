/* A whole simulated run; see run.h. */
#include "run.h"

#include <stdbool.h>

#include "dcmp_cycle.h"
#include "run_setup.h"
#include "simlib.h"

#define SAME_INSTANT_SHARE 0.02 /* of the delay: instants that differ by less are one */
#define NONE (__builtin_nan(""))

/* What of a cycle comes next. */
enum run_next { NEXT_SAMPLE = 0, NEXT_SENSE = 1, NEXT_ACT = 2 };

struct run {
    struct dcmp_cycle_setup setup;
    struct simlib sim;
    struct dcmp_cycle cycle;
    struct dcmp_measurement sample;
    enum run_next next;
    bool answered;      /* the host has answered what was asked of this cycle */
    bool jumps;         /* the trajectory begins in this cycle */
    double delay;       /* s */
    double soft_start;  /* s */
    double period_ns;
    int64_t now_ns;     /* of the virtual clock */
    double previous;    /* s, when the sample before arrived; NaN for none */
    double first;       /* s, what the first sample of the loop was late */
    double arrived;     /* s */
    double due;         /* s, the instant that the cycle before looked ahead to; NaN for none */
    struct dcmp_reference then; /* the reference there */
    struct dcmp_reference now;  /* the reference at the sample's own instant */
    int64_t cycles;
};

/* What a call was given. */
struct job {
    struct run_progress *progress;
    const struct run_reference *rows;
    int64_t n_rows;
};

/* ------------------------------------------------------------------------------------------------------------- set-up */

static struct simlib rig_of(const struct run_parameters *p)
{
    const struct simlib sim = {
        .seed = p->seed,
        .lost = p->lost,
        .plant = {.model = {p->plant_f0, p->plant_f1, p->plant_gravity, p->plant_ku, p->plant_eta,
                            p->plant_eta_amplitude, p->plant_eta_rate},
                  .belief = {p->f0, p->ku},
                  .step = p->plant_step,
                  .steps = p->plant_steps,
                  .state = {.position = p->plant_position},
                  .disturbance = NONE},
        .encoder = {.model = {p->count, p->phase, p->noise}},
        .amplifier = {.model = {p->amplifier_limit, p->amplifier_slew, p->dead_zone, p->quantum,
                                p->delay_samples}},
    };
    return sim;
}

int64_t run_state_bytes(void)
{
    return (int64_t)sizeof(struct run);
}

void run_begin(struct run *run, const struct run_parameters *parameters)
{
    const struct run first = {
        .setup = run_setup_of(parameters),
        .sim = rig_of(parameters),
        .delay = parameters->delay,
        .soft_start = parameters->soft_start,
        .period_ns = 1e9 * parameters->period,
        .previous = NONE,
        .first = NONE,
        .due = NONE,
    };
    *run = first;
    run->cycle = dcmp_cycle_begin(&run->setup);
}

/* -------------------------------------------------------------------------------------------------------- the reference */

/* Whether the trajectory needs a row of its reference. */
static inline bool refers(const struct run *run, const struct job *job)
{
    return run->cycle.trajectory.begun || job->progress->whole != 0;
}

static inline const struct run_reference *row_of(const struct run *run, const struct job *job)
{
    return &job->rows[run->sample.tick - job->progress->first_row];
}

static inline bool has_row(const struct run *run, const struct job *job)
{
    const int64_t place = run->sample.tick - job->progress->first_row;
    return !refers(run, job) || (place >= 0 && place < job->n_rows);
}

/* What the trajectory makes of a value of its reference at a moment; with `whole`, it is that value. */
static inline struct dcmp_reference made(const struct run *run, const struct job *job, struct dcmp_moment moment,
                                         struct dcmp_reference value)
{
    return job->progress->whole != 0 ? value
                                     : dcmp_trajectory_at(run->cycle.trajectory, moment, run->soft_start, value);
}

static inline struct dcmp_reference answer_of(const struct job *job)
{
    const struct run_progress *progress = job->progress;
    const struct dcmp_reference answer = {progress->answer_x, progress->answer_v, progress->answer_a};
    return answer;
}

/* At the instant at which the command acts. */
static inline struct dcmp_reference reference_ahead(const struct run *run, const struct job *job)
{
    const double period = run->setup.period;
    struct dcmp_reference value = {0.0, 0.0, 0.0};
    if (refers(run, job)) {
        const struct run_reference *row = row_of(run, job);
        value.position = row->x;
        value.velocity = row->v;
        value.acceleration = row->a;
    }
    const struct dcmp_moment moment =
        dcmp_moment_after(run->cycle.trajectory, run->sample.tick, run->delay, run->soft_start, period);
    return made(run, job, moment, value);
}

/* At the sample's own instant. */
static inline struct dcmp_reference reference_now(const struct run *run, const struct job *job)
{
    struct dcmp_reference value = answer_of(job);
    if (refers(run, job) && job->progress->has_now != 0) {
        const struct run_reference *row = row_of(run, job);
        value.position = row->x_now;
        value.velocity = row->v_now;
        value.acceleration = row->a_now;
    }
    const struct dcmp_moment moment =
        dcmp_moment_after(run->cycle.trajectory, run->sample.tick, 0.0, run->soft_start, run->setup.period);
    return made(run, job, moment, value);
}

/* Whether the rows have the middle between the last sample and this one. */
static inline bool has_middle(const struct run *run, const struct job *job)
{
    return job->progress->has_middle != 0 && run->sample.tick - run->cycle.told == 1;
}

/* The velocity in the middle between the last sample and this one, rad/s. */
static inline double velocity_between(const struct run *run, const struct job *job)
{
    struct dcmp_reference value = answer_of(job);
    if (refers(run, job) && has_middle(run, job)) {
        value.position = row_of(run, job)->x_middle;
        value.velocity = row_of(run, job)->v_middle;
    }
    const struct dcmp_moment moment = dcmp_moment_between(run->cycle.trajectory, run->cycle.told, run->sample.tick,
                                                          run->soft_start, run->setup.period);
    return made(run, job, moment, value).velocity;
}

/* ------------------------------------------------------------------------------------------------------ parts of a cycle */

/* The next sample that is not left out, and when it arrives by the virtual clock. */
static inline void take_sample(struct run *run)
{
    do {
        rig_sample(&run->sim);
        const struct dcmp_measurement sample = {run->sim.tick, run->sim.shown, run->sim.voltage};
        run->sample = sample;
    } while (dcmp_cycle_leaves_out(&run->cycle, &run->setup, run->sample));
    const double rounded_ns = (double)run->sample.tick * run->period_ns + 0.5;
    const int64_t due_ns = (int64_t)rounded_ns;
    run->now_ns = due_ns > run->now_ns ? due_ns : run->now_ns;
    run->arrived = (double)run->now_ns * 1e-9;
    if (run->first != run->first) {
        run->first = run->arrived - dcmp_instant(run->sample.tick, run->setup.period);
    }
    run->answered = false;
    run->jumps = false;
}

/* From the sample to the phase: 0 to go on, or why to stop. */
static inline int64_t sense(struct run *run, const struct job *job)
{
    double before = 0.0;
    double at = 0.0;
    if (run->setup.feedforward) {
        if (!has_row(run, job)) {
            return RUN_REFERENCES_USED;
        }
        const bool needs = refers(run, job) && run->sample.tick > run->cycle.told && !has_middle(run, job);
        if (needs && !run->answered) {
            job->progress->asked = 0.5 * (dcmp_instant(run->sample.tick, run->setup.period) +
                                          dcmp_instant(run->cycle.told, run->setup.period));
            run->answered = true;
            return RUN_ASKS;
        }
        before = velocity_between(run, job);
        at = reference_ahead(run, job).velocity;
    }
    run->answered = false;
    run->jumps = dcmp_cycle_sense(&run->cycle, &run->setup, run->sample, before, at);
    run->next = NEXT_ACT;
    if (run->jumps) {
        job->progress->began = dcmp_instant(run->sample.tick, run->setup.period);
        job->progress->x0 = run->cycle.trajectory.x0;
        return RUN_BEGINS;
    }
    return 0;
}

/* The reference at the sample's own instant: 0 where it is known, or RUN_ASKS. */
static inline int64_t align(struct run *run, const struct job *job)
{
    const double off = SAME_INSTANT_SHARE * run->delay;
    const double early = dcmp_instant(run->sample.tick, run->setup.period) - run->due;
    if (run->delay == 0.0) {
        return 0;
    }
    if (!run->jumps && -off < early && early < off) {
        run->now = run->then;
        return 0;
    }
    if (refers(run, job) && job->progress->has_now == 0 && !run->answered) {
        job->progress->asked = dcmp_instant(run->sample.tick, run->setup.period);
        run->answered = true;
        return RUN_ASKS;
    }
    run->now = reference_now(run, job);
    return 0;
}

static inline void put(double *out, double a, double b, double c)
{
    out[0] = a;
    out[1] = b;
    out[2] = c;
}

/* Write the row of a cycle. */
static inline void write_row(struct run *run, const struct job *job, double voltage, double *row)
{
    const struct dcmp_cycle *cycle = &run->cycle;
    const struct simlib_plant *plant = &run->sim.plant;
    const struct dcmp_reference then = cycle->reference;
    const double t = dcmp_instant(run->sample.tick, run->setup.period);
    const struct dcmp_reference now = (run->delay == 0.0) ? then : run->now;
    put(&row[0], t, run->sample.position, run->sample.voltage);
    row[3] = 0.0; /* no fault */
    put(&row[4], cycle->estimate.position, cycle->estimate.velocity, cycle->estimate.disturbance);
    put(&row[7], then.position, then.velocity, then.acceleration);
    row[10] = cycle->demand;
    row[11] = voltage;
    put(&row[12], run->arrived - run->previous, run->arrived - run->first - t, 0.0);
    put(&row[15], plant->state.position, plant->state.velocity, plant->disturbance);
    put(&row[18], now.position, now.velocity, now.acceleration);
    row[21] = job->progress->began;
    run->then = then;
    run->due = t + run->delay;
}

/* Write what the friction filter tells of itself. */
static inline void write_diagnosis(const struct dcmp_friction_kalman *filter, double *out)
{
    const double variance = filter->covariance.p33;
    put(&out[0], filter->state.d, filter->state.f, (variance > 0.0) ? dcmp_square_root(variance) : 0.0);
    put(&out[3], filter->state.s, filter->trust.m, filter->trust.scatter);
    out[6] = filter->sticks ? 1.0 : 0.0;
    out[7] = (double)filter->steps;
}

/* Write what a cycle has to tell; return how much that is. */
static inline int64_t write_notes(const struct run *run, struct run_event *log)
{
    int64_t told = 0;
    for (uint32_t i = 0; (i < run->cycle.notes.count) && (i < DCMP_NOTES_MAX); i++) {
        const struct dcmp_note note = run->cycle.notes.note[i];
        const struct run_event event = {run->sample.tick, note.code, note.first, note.second, 0.0};
        log[told] = event;
        told++;
    }
    return told;
}

/* -------------------------------------------------------------------------------------------------------------- the run */

static void report(const struct run *run, struct run_progress *progress)
{
    const struct dcmp_cycle *cycle = &run->cycle;
    progress->tick = run->sample.tick;
    progress->cycles = run->cycles;
    progress->phase = (int64_t)cycle->phases.phase;
    progress->outliers = cycle->outliers.count;
    progress->clamped = cycle->limiter.clamped;
    progress->steps = cycle->friction.steps;
    progress->gain_known = cycle->polarity.found ? 1 : 0;
    progress->gain = cycle->polarity.gain.gain;
    progress->deviation = cycle->polarity.gain.deviation;
    progress->cause = (int64_t)cycle->phases.cause.cause;
    progress->cause_tick = cycle->phases.cause.tick;
    progress->first = cycle->phases.cause.first;
    progress->second = cycle->phases.cause.second;
    progress->orderly = cycle->phases.orderly ? 1 : 0;
    progress->remembers = cycle->remembers ? 1 : 0;
}

/* Go on with a cycle up to the reference that it needs: 0, or why to stop. */
static inline int64_t prepare(struct run *run, const struct job *job)
{
    if (run->next == NEXT_SAMPLE) {
        take_sample(run);
        run->next = NEXT_SENSE;
    }
    if (run->next == NEXT_SENSE) {
        const int64_t why = sense(run, job);
        if (why != 0) {
            return why;
        }
    }
    if (!has_row(run, job)) {
        return RUN_REFERENCES_USED;
    }
    return align(run, job);
}

/* What a cycle that has ended means for the run: 0 to go on. */
static inline int64_t ended(const struct run *run, double until)
{
    const struct dcmp_phases *phases = &run->cycle.phases;
    if (phases->over) {
        return RUN_OVER;
    }
    if (dcmp_instant(run->sample.tick, run->setup.period) >= until && phases->phase != DCMP_RUN_STOPPING) {
        return RUN_REACHED;
    }
    return 0;
}

int64_t run_cycles(struct run *run, struct run_progress *progress, const struct run_reference *rows, int64_t n_rows,
                   double *out, int64_t max_rows, struct run_event *log, int64_t max_log)
{
    const struct job job = {progress, rows, n_rows};
    const int64_t width = RUN_FIELDS + (run->setup.knows_friction ? RUN_FURTHER : 0);
    int64_t written = 0;
    int64_t told = 0;
    int64_t why = 0;
    if (progress->fresh != 0) {
        progress->fresh = 0;
        run->first = NONE;
        run->previous = NONE;
        run->cycle.holds = false;
    }
    while (why == 0) {
        if (written == max_rows) {
            why = RUN_ROWS_FULL;
        } else if (max_log - told < RUN_EVENTS_MIN) {
            why = RUN_LOG_FULL;
        } else {
            why = prepare(run, &job);
        }
        if (why == 0) {
            double *row = &out[written * width];
            const double voltage =
                dcmp_cycle_act(&run->cycle, &run->setup, run->sample, reference_ahead(run, &job));
            run->sim.amplifier.newest = voltage;
            write_row(run, &job, voltage, row);
            if (run->setup.knows_friction) {
                write_diagnosis(&run->cycle.friction, &row[RUN_FIELDS]);
            }
            told += write_notes(run, &log[told]);
            run->previous = run->arrived;
            run->next = NEXT_SAMPLE;
            run->cycles++;
            written++;
            why = ended(run, progress->until);
        }
    }
    progress->rows = written;
    progress->events = told;
    report(run, progress);
    return why;
}
