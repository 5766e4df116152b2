#include "model_inside.h"

bool model_is_sound(const struct dcmp_config *config)
{
    return config->counts_per_rev >= 1 && config->period_us >= 50 && config->period_us <= 100000 &&
           config->voltage_limit_mV >= 1 && config->voltage_limit_mV <= 32767 && config->slew_mV_per_ms >= 0 &&
           config->watchdog_ms >= 5 && config->watchdog_ms <= 50 && config->speed_limit_counts_s >= 1 &&
           config->travel_limit_counts >= 1 && config->supply_mV >= 0 && config->node <= 15u;
}

/* What a parameter may be set to; false for one that may not. */
static bool range_of(const struct model *model, uint32_t id, int32_t *lowest, int32_t *highest)
{
    *lowest = 1;
    *highest = model->built[id];
    switch (id) {
    case DCMP_VOLTAGE_LIMIT_MV:
    case DCMP_SPEED_LIMIT_COUNTS_S:
    case DCMP_TRAVEL_LIMIT_COUNTS:
        return true;
    case DCMP_SLEW_MV_PER_MS:
        *highest = model->built[id] == 0 ? INT32_MAX : model->built[id];
        return true;
    case DCMP_WATCHDOG_MS:
        *lowest = 5;
        return true;
    case DCMP_TRAVEL_ORIGIN_COUNTS:
        *lowest = -1;
        *highest = 0xFFFFFF;
        return true;
    case DCMP_EDGE_STAMPS:
        *lowest = 0;
        *highest = model->edges ? 1 : 0;
        return true;
    default:
        return false;
    }
}

uint8_t model_set_parameter(struct model *model, uint32_t id, int32_t value, bool owner)
{
    int32_t lowest = 0;
    int32_t highest = 0;
    if (id == 0u || id >= MODEL_PARAMETERS) {
        return 1;
    }
    if (!range_of(model, id, &lowest, &highest)) {
        return 2;
    }
    if (value < lowest || value > highest) {
        return 3;
    }
    if (model->state != MODEL_IDLE) {
        return 4;
    }
    if (!owner) {
        return 5;
    }
    model->value[id] = value;
    return 0;
}
