#include "dcmp_transmit.h"

void dcmp_transmit_init(struct dcmp_transmit *transmit)
{
    for (uint32_t i = 0; i < (uint32_t)DCMP_REPORTS; i++) {
        transmit->waiting[i] = false;
    }
    dcmp_transmit_forget_answers(transmit);
}

bool dcmp_transmit_report(struct dcmp_transmit *transmit, enum dcmp_report report, const struct dcmp_frame *frame)
{
    const bool lost = transmit->waiting[report];
    transmit->reports[report] = *frame;
    transmit->waiting[report] = true;
    return lost;
}

void dcmp_transmit_withdraw(struct dcmp_transmit *transmit, enum dcmp_report report)
{
    transmit->waiting[report] = false;
}

bool dcmp_transmit_next_report(struct dcmp_transmit *transmit, struct dcmp_frame *frame)
{
    for (uint32_t i = 0; i < (uint32_t)DCMP_REPORTS; i++) {
        if (transmit->waiting[i]) {
            transmit->waiting[i] = false;
            *frame = transmit->reports[i];
            return true;
        }
    }
    return false;
}

bool dcmp_transmit_answer(struct dcmp_transmit *transmit, const struct dcmp_answer *answer)
{
    if (transmit->count == DCMP_ANSWERS_MAX) {
        return false;
    }
    transmit->answers[((uint32_t)transmit->first + transmit->count) % DCMP_ANSWERS_MAX] = *answer;
    transmit->count++;
    return true;
}

void dcmp_transmit_forget_answers(struct dcmp_transmit *transmit)
{
    transmit->first = 0;
    transmit->count = 0;
}

bool dcmp_transmit_next_answer(struct dcmp_transmit *transmit, struct dcmp_answer *answer)
{
    if (transmit->count == 0u) {
        return false;
    }
    *answer = transmit->answers[transmit->first];
    transmit->first = (uint8_t)((transmit->first + 1u) % DCMP_ANSWERS_MAX);
    transmit->count--;
    return true;
}
