#include "dcmp_health.h"

void dcmp_health_init(struct dcmp_health *health)
{
    const struct dcmp_health_report nothing = {0};
    health->report = nothing;
    dcmp_history_init(&health->frames);
}

void dcmp_health_count(uint8_t *counter)
{
    if (*counter < 255u) {
        (*counter)++;
    }
}

void dcmp_health_frame(struct dcmp_health *health, bool corrupt)
{
    dcmp_history_add(&health->frames, corrupt);
    if (corrupt) {
        dcmp_health_count(&health->report.crc_errors);
    }
}

bool dcmp_health_link_corrupt(const struct dcmp_health *health)
{
    return health->frames.count >= DCMP_CORRUPT_LIMIT;
}
