#include "dcmp_parameters.h"

#include "dcmp_encoder.h"

#define PERIOD_MIN_US 50
#define PERIOD_MAX_US 100000
#define NODE_MAX 15

static bool within(int32_t value, int32_t lowest, int32_t highest)
{
    return value >= lowest && value <= highest;
}

bool dcmp_config_valid(const struct dcmp_config *config)
{
    const bool fits[] = {
        within(config->counts_per_rev, 1, INT32_MAX),
        within(config->period_us, PERIOD_MIN_US, PERIOD_MAX_US),
        within(config->voltage_limit_mV, 1, INT16_MAX),
        within(config->slew_mV_per_ms, 0, INT32_MAX),
        within(config->watchdog_ms, DCMP_WATCHDOG_MIN_MS, DCMP_WATCHDOG_MAX_MS),
        within(config->speed_limit_counts_s, 1, INT32_MAX),
        within(config->travel_limit_counts, 1, INT32_MAX),
        within(config->supply_mV, 0, INT32_MAX),
        within(config->node, 0, NODE_MAX),
    };
    bool valid = true;
    for (uint32_t i = 0; i < sizeof fits / sizeof fits[0]; i++) {
        valid = valid && fits[i];
    }
    return valid;
}

static void settable(struct dcmp_parameters *parameters, enum dcmp_parameter id, int32_t lowest, int32_t highest)
{
    parameters->range[id].lowest = lowest;
    parameters->range[id].highest = highest;
}

void dcmp_parameters_init(struct dcmp_parameters *parameters, const struct dcmp_config *config)
{
    for (uint32_t id = 0; id < DCMP_PARAMETER_SLOTS; id++) {
        parameters->value[id] = 0;
        parameters->range[id].lowest = 1;
        parameters->range[id].highest = 0;
    }
    parameters->value[DCMP_BOARD] = config->board;
    parameters->value[DCMP_BOOT_COUNT] = config->boot_count;
    parameters->value[DCMP_RESET_CAUSE] = config->reset_cause;
    parameters->value[DCMP_COUNTS_PER_REV] = config->counts_per_rev;
    parameters->value[DCMP_PERIOD_US] = config->period_us;
    parameters->value[DCMP_VOLTAGE_LIMIT_MV] = config->voltage_limit_mV;
    parameters->value[DCMP_SLEW_MV_PER_MS] = config->slew_mV_per_ms;
    parameters->value[DCMP_WATCHDOG_MS] = config->watchdog_ms;
    parameters->value[DCMP_SPEED_LIMIT_COUNTS_S] = config->speed_limit_counts_s;
    parameters->value[DCMP_TRAVEL_LIMIT_COUNTS] = config->travel_limit_counts;
    parameters->value[DCMP_LAST_FAULT] = config->last_fault;
    parameters->value[DCMP_LAST_FAULT_DETAIL] = config->last_fault_detail;
    parameters->value[DCMP_SUPPLY_MV] = config->supply_mV;
    parameters->value[DCMP_TRAVEL_ORIGIN_COUNTS] = DCMP_FIRST_ARMING;
    settable(parameters, DCMP_VOLTAGE_LIMIT_MV, 1, config->voltage_limit_mV);
    settable(parameters, DCMP_SLEW_MV_PER_MS, 1, config->slew_mV_per_ms == 0 ? INT32_MAX : config->slew_mV_per_ms);
    settable(parameters, DCMP_WATCHDOG_MS, DCMP_WATCHDOG_MIN_MS, config->watchdog_ms);
    settable(parameters, DCMP_SPEED_LIMIT_COUNTS_S, 1, config->speed_limit_counts_s);
    settable(parameters, DCMP_TRAVEL_LIMIT_COUNTS, 1, config->travel_limit_counts);
    settable(parameters, DCMP_TRAVEL_ORIGIN_COUNTS, DCMP_FIRST_ARMING, (int32_t)DCMP_COUNT_MASK);
    settable(parameters, DCMP_EDGE_STAMPS, 0, config->edge_stamps ? 1 : 0);
    for (uint32_t id = 0; id < DCMP_PARAMETER_SLOTS; id++) {
        parameters->built[id] = parameters->value[id];
    }
}

void dcmp_parameters_restore(struct dcmp_parameters *parameters)
{
    for (uint32_t id = 0; id < DCMP_PARAMETER_SLOTS; id++) {
        if (parameters->range[id].lowest <= parameters->range[id].highest) {
            parameters->value[id] = parameters->built[id];
        }
    }
}

bool dcmp_parameters_known(uint8_t id)
{
    return id >= 1u && id < DCMP_PARAMETER_SLOTS;
}

int32_t dcmp_parameters_get(const struct dcmp_parameters *parameters, uint8_t id)
{
    return dcmp_parameters_known(id) ? parameters->value[id] : 0;
}

enum dcmp_result dcmp_parameters_set(struct dcmp_parameters *parameters, uint8_t id, int32_t value, bool idle,
                                     bool owner)
{
    if (!dcmp_parameters_known(id)) {
        return DCMP_UNKNOWN;
    }
    const struct dcmp_range *range = &parameters->range[id];
    if (range->lowest > range->highest) {
        return DCMP_READ_ONLY;
    }
    if (!within(value, range->lowest, range->highest)) {
        return DCMP_OUT_OF_RANGE;
    }
    if (!idle) {
        return DCMP_NOT_IDLE;
    }
    if (!owner) {
        return DCMP_NOT_OWNER;
    }
    parameters->value[id] = value;
    return DCMP_OK;
}
