/* What waits to be sent. Of each kind of report only the newest is kept, so that a link that was blocked never brings
 * old ones; answers queue up, and their values are read when they are sent. */
#ifndef DCMP_TRANSMIT_H
#define DCMP_TRANSMIT_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_frame.h"

#define DCMP_ANSWERS_MAX 16u

/* In the order in which they are sent; answers come last. */
enum dcmp_report { DCMP_REPORT_FAULT, DCMP_REPORT_SAMPLE, DCMP_REPORT_EDGE, DCMP_REPORT_HEALTH, DCMP_REPORTS };

struct dcmp_answer {
    bool identity; /* IDENTITY, else PARAMETER_VALUE */
    bool busy;
    bool owned;
    bool mismatch;
    uint8_t id;
    uint8_t result;
};

struct dcmp_transmit {
    struct dcmp_frame reports[DCMP_REPORTS];
    bool waiting[DCMP_REPORTS];
    struct dcmp_answer answers[DCMP_ANSWERS_MAX];
    uint8_t first;
    uint8_t count;
};

void dcmp_transmit_init(struct dcmp_transmit *transmit);

/* True if one that had not been sent is lost. */
bool dcmp_transmit_report(struct dcmp_transmit *transmit, enum dcmp_report report, const struct dcmp_frame *frame);
void dcmp_transmit_withdraw(struct dcmp_transmit *transmit, enum dcmp_report report);
bool dcmp_transmit_next_report(struct dcmp_transmit *transmit, struct dcmp_frame *frame);

/* False if there is no room. */
bool dcmp_transmit_answer(struct dcmp_transmit *transmit, const struct dcmp_answer *answer);
void dcmp_transmit_forget_answers(struct dcmp_transmit *transmit);
bool dcmp_transmit_next_answer(struct dcmp_transmit *transmit, struct dcmp_answer *answer);

#endif
