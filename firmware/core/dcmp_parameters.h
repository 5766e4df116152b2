/* What can be asked for over the wire, and what of it can be changed. */
#ifndef DCMP_PARAMETERS_H
#define DCMP_PARAMETERS_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_device.h"
#include "dcmp_message.h"

#define DCMP_PARAMETER_SLOTS 17u /* numbers from 1 on */
#define DCMP_WATCHDOG_MIN_MS 5
#define DCMP_WATCHDOG_MAX_MS 50
#define DCMP_FIRST_ARMING (-1) /* TRAVEL_ORIGIN_COUNTS: travel counts from where the device was armed first */

struct dcmp_range {
    int32_t lowest; /* above `highest`: may not be set */
    int32_t highest;
};

struct dcmp_parameters {
    int32_t value[DCMP_PARAMETER_SLOTS];
    int32_t built[DCMP_PARAMETER_SLOTS]; /* what the board was built with */
    struct dcmp_range range[DCMP_PARAMETER_SLOTS];
};

/* Whether every field is inside the range that dcmp_device.h names. */
bool dcmp_config_valid(const struct dcmp_config *config);

void dcmp_parameters_init(struct dcmp_parameters *parameters, const struct dcmp_config *config);

/* Forget what a session changed: the board is as it was built. */
void dcmp_parameters_restore(struct dcmp_parameters *parameters);

/* 0 for one that does not exist. */
int32_t dcmp_parameters_get(const struct dcmp_parameters *parameters, uint8_t id);
bool dcmp_parameters_known(uint8_t id);
enum dcmp_result dcmp_parameters_set(struct dcmp_parameters *parameters, uint8_t id, int32_t value, bool idle,
                                     bool owner);

#endif
