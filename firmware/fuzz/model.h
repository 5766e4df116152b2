/* What a device has to do, by docs/protocol.md: a second author's device, which the core is compared with frame by frame.
 * It knows what goes into the core and what comes out of it, and nothing of the inside.
 *
 * A change of the page changes two places here: model.c (or motion.c, for the encoder), and the operations of
 * target.c that ask for it. */
#ifndef FUZZ_MODEL_H
#define FUZZ_MODEL_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_device.h"
#include "motion.h"

#define MODEL_PARAMETERS 17u /* one more than the highest number */
#define MODEL_ANSWERS 16u
#define MODEL_FRAMES 100u /* among which corrupt ones are weighed */

enum model_state { MODEL_BOOT, MODEL_IDLE, MODEL_ARMING, MODEL_RUN, MODEL_FAULT };

/* In the order in which HEALTH has them. */
enum model_counter { CRC_ERRORS, SEQUENCE_GAPS, RING_OVERRUNS, BUS_OFFS, LATE_TICKS, IDLE_PERCENT, COUNTERS };

/* In the order in which they are sent. */
enum model_report { REPORT_FAULT, REPORT_SAMPLE, REPORT_EDGE, REPORT_HEALTH, REPORTS };

struct model_answer {
    uint8_t number; /* WIRE_IDENTITY or WIRE_VALUE */
    uint8_t id;
    uint8_t last; /* the flags, or the result */
};

struct model {
    bool alive; /* what it was built with is within its ranges */
    uint32_t node;
    uint32_t version;
    uint32_t now_us;
    enum model_state state;
    int32_t value[MODEL_PARAMETERS];
    int32_t built[MODEL_PARAMETERS];
    bool edges; /* can be stamped */
    bool link_up;
    /* the session */
    uint32_t owner;
    uint32_t heard_us;
    bool first_of_session; /* no DRIVE accepted yet */
    uint32_t seq;          /* of the last accepted DRIVE */
    /* driving */
    uint32_t arming;       /* counted */
    uint32_t fed_us;
    uint32_t patience_us;  /* the watchdog's time, or the DRIVE's */
    bool driven;           /* since the tick before */
    int64_t command_mV;
    int64_t voltage_uV;
    bool limited;
    /* the fault */
    uint32_t code;
    uint32_t fault_tick;
    int32_t detail;
    bool lowered;
    uint32_t fault_due;    /* ticks to the next FAULT */
    uint32_t health_due;
    /* frames */
    bool corrupt[MODEL_FRAMES];
    uint32_t frame;        /* the next one's place */
    uint32_t bad_frames;
    uint8_t counters[COUNTERS];
    struct motion motion;
    /* what it has to say */
    bool waiting[REPORTS];
    struct dcmp_frame reports[REPORTS];
    struct model_answer answers[MODEL_ANSWERS];
    uint32_t answer;       /* the oldest */
    uint32_t answers_waiting;
    /* for statistics */
    uint32_t ticks;
    uint32_t given; /* frames to this device, good or corrupt */
};

void model_start(struct model *model, const struct dcmp_config *config, uint32_t now_us);
void model_frame(struct model *model, const struct dcmp_frame *frame);
void model_corrupt(struct model *model);
void model_link(struct model *model, bool up);
void model_fail(struct model *model, uint32_t code, int32_t detail);
void model_tick(struct model *model, uint32_t counts, const struct dcmp_edge *edge);
void model_count(struct model *model, enum model_counter counter);

/* Time alone: watchdog, link, lease. */
void model_look(struct model *model);

bool model_transmit(struct model *model, struct dcmp_frame *frame);
struct dcmp_output model_output(const struct model *model);
bool model_waits(const struct model *model);

#endif
