#include "dcmp_session.h"

void dcmp_session_end(struct dcmp_session *session)
{
    session->owner = 0;
    session->heard_us = 0;
    session->has_predecessor = false;
    session->seq = 0;
    session->step = 0;
}

/* Session 0 stands for no owner, so it never owns the device, even while no session does. */
bool dcmp_session_owns(const struct dcmp_session *session, uint16_t candidate)
{
    return candidate != 0u && candidate == session->owner;
}

void dcmp_session_renew(struct dcmp_session *session, uint32_t now_us)
{
    session->heard_us = now_us;
}

bool dcmp_session_lapsed(const struct dcmp_session *session, uint32_t now_us)
{
    return session->owner != 0u && now_us - session->heard_us >= DCMP_LEASE_US;
}

bool dcmp_session_ask(struct dcmp_session *session, uint16_t candidate, uint32_t now_us)
{
    if (candidate == 0u || session->owner != 0u) {
        return false;
    }
    dcmp_session_end(session);
    session->owner = candidate;
    session->heard_us = now_us;
    return true;
}

enum dcmp_verdict dcmp_session_judge(struct dcmp_session *session, const struct dcmp_drive *drive, uint32_t tick,
                                     uint32_t oldest)
{
    const uint32_t age = (tick - drive->seq) & DCMP_SEQ_MASK;
    const uint32_t step = ((uint32_t)drive->seq - session->seq) & DCMP_SEQ_MASK;
    if (!dcmp_session_owns(session, drive->session)) {
        return DCMP_DROPPED;
    }
    if (drive->ttl_ms < DCMP_TTL_MIN_MS || drive->ttl_ms > DCMP_TTL_MAX_MS) {
        return DCMP_DROPPED;
    }
    if ((int)drive->arm + (int)drive->clear + (int)drive->release > 1) {
        return DCMP_DROPPED; /* no host says that; a damaged slcan line may */
    }
    if (age > oldest) {
        return DCMP_GAP;
    }
    if (session->has_predecessor && (step == 0u || step > DCMP_SEQ_NEWER_MAX)) {
        return DCMP_GAP;
    }
    session->has_predecessor = true;
    session->seq = drive->seq;
    session->step = (uint16_t)step;
    return DCMP_ACCEPTED;
}
