/* Work that a chip and a computer do alike, in single precision: rows in, rows of results out. Every job keeps its state between
 * calls; a state of 0 has not begun. */
#ifndef JOBS_H
#define JOBS_H

#include <stdint.h>

#define JOB_RESULTS 16

/* A sample, and what goes with it. */
struct job_row {
    int32_t tick;
    int32_t restarts; /* flag: the state is forgotten first */
    float position;    /* rad, as the encoder shows it */
    float voltage;     /* V, applied over the period before */
    float gap;         /* s, since the row before; the clock of a job that has no ticks */
    float x;           /* rad, of the reference at the instant at which the command acts */
    float v;
    float a;
    float x_middle;    /* rad, in the middle between this sample and the one before */
    float v_middle;
};

/* 32 bits each, so that whole numbers are compared as they are. */
union job_result {
    float number;
    int32_t whole;
};

typedef void job(const void *setup, void *state, const struct job_row *rows, union job_result *out, uint32_t n);

job r1_job;
job friction_job;
job cycle_job;

/* Around the one step of a row that is counted; nothing on this computer. */
void job_counts(void);
void job_counted(void);

/* The largest state of a job, bytes. */
#define JOB_STATE_BYTES 4096

#endif
