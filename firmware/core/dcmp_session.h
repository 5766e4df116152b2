/* Who owns the device, for how long, and which of its DRIVEs are fresh. */
#ifndef DCMP_SESSION_H
#define DCMP_SESSION_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_message.h"

#define DCMP_LEASE_US 500000u
#define DCMP_SEQ_MASK 0x1FFFu
#define DCMP_SEQ_NEWER_MAX 4095u
#define DCMP_TTL_MIN_MS 5u
#define DCMP_TTL_MAX_MS 50u

struct dcmp_session {
    uint16_t owner;       /* 0: no owner */
    uint32_t heard_us;    /* its last valid message */
    bool has_predecessor; /* an accepted DRIVE of this session */
    uint16_t seq;         /* of that one */
    uint16_t step;        /* from the one before to that one */
};

enum dcmp_verdict { DCMP_DROPPED, DCMP_GAP, DCMP_ACCEPTED };

void dcmp_session_end(struct dcmp_session *session);
bool dcmp_session_owns(const struct dcmp_session *session, uint16_t candidate);
void dcmp_session_renew(struct dcmp_session *session, uint32_t now_us);
bool dcmp_session_lapsed(const struct dcmp_session *session, uint32_t now_us);

/* True if the candidate becomes the owner. */
bool dcmp_session_ask(struct dcmp_session *session, uint16_t candidate, uint32_t now_us);

/* Judge a DRIVE against the tick of the newest SAMPLE; an accepted one is remembered. */
enum dcmp_verdict dcmp_session_judge(struct dcmp_session *session, const struct dcmp_drive *drive, uint32_t tick,
                                     uint32_t oldest);

#endif
