/* What must hold independently of the model: judged by input, output and time alone. */
#ifndef FUZZ_WATCH_H
#define FUZZ_WATCH_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_device.h"

struct watch {
    uint32_t armed;     /* DRIVEs with `arm` since ENABLE was low and nothing forbade it */
    uint32_t driven_us; /* when the newest of them came */
    int32_t voltage_mV; /* after the tick before */
    bool enabled;
    bool link_down;
};

/* A frame goes in. */
void watch_frame(struct watch *watch, const struct dcmp_config *config, const struct dcmp_frame *frame,
                 uint32_t now_us);

/* The board failed, or the line hung up. */
void watch_forbid(struct watch *watch);

/* What came out; null, or what is wrong with it. */
const char *watch_output(struct watch *watch, const struct dcmp_config *config, struct dcmp_output output,
                         uint32_t now_us);

/* The same at a tick: the slew too. */
const char *watch_tick(struct watch *watch, const struct dcmp_config *config, struct dcmp_output output,
                       uint32_t now_us);

#endif
