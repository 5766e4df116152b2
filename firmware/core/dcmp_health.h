/* Counters since boot that stop at 255, and how bad the link was of late. */
#ifndef DCMP_HEALTH_H
#define DCMP_HEALTH_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_history.h"
#include "dcmp_message.h"

#define DCMP_CORRUPT_LIMIT 10u /* among the last 100 frames */

struct dcmp_health {
    struct dcmp_health_report report;
    struct dcmp_history frames; /* of this device, and corrupt ones */
};

void dcmp_health_init(struct dcmp_health *health);

/* Count one more, up to 255. */
void dcmp_health_count(uint8_t *counter);

/* A frame of this device came, in order or corrupt. */
void dcmp_health_frame(struct dcmp_health *health, bool corrupt);

bool dcmp_health_link_corrupt(const struct dcmp_health *health);

#endif
