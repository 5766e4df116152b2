/* What every board with a chip does: the core at a tick and between two of them, bytes from and to rings, and what is to
 * be remembered of a fault. It knows no registers: time, counts and bytes come in as arguments.
 *
 * Everything here but the rings' other ends is called with one and the same priority. */
#ifndef APP_H
#define APP_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_device.h"
#include "dcmp_device_state.h"
#include "dcmp_port.h"
#include "fault_log.h"
#include "life.h"
#include "ring.h"

/* Details of the fault INTERNAL: what a board found wrong with itself. */
enum app_failure {
    APP_WELL = 0,
    APP_NO_CRYSTAL = 1,  /* the clock is only about right */
    APP_NO_RECORD = 2,   /* no record says what is connected: tools/flash.py */
    APP_NO_MEMORY = 4,   /* the record could not be written */
    APP_NO_LINK = 8,     /* the controller of the link does not answer */
    APP_BAD_RECORD = 16, /* a value in it is outside its range */
    APP_CRYSTAL_STOPPED = 32,
    APP_CRASHED = 64 /* an unexpected exception; the next word is that of the processor */
};

struct app {
    struct dcmp_device device;
    struct dcmp_port port;
    struct ring received; /* written by the interrupt of the byte port */
    struct ring sending;  /* read by it */
    volatile bool lost;   /* written by it: bytes were lost */
    volatile uint8_t idle_percent;
    struct life life;
    struct fault_log *log;
    volatile uint32_t answers; /* times that frames over the byte port left it nothing to wait for */
    bool inside;               /* of a frame that has begun */
    int32_t boot_count;
    int32_t failure; /* what was wrong at the start, until it was said */
    bool faulted;
};

/* What a tick knows. */
struct app_tick {
    uint32_t now_us;
    uint32_t counts;
    struct dcmp_edge edge;
    bool late;       /* it was served too late */
    uint32_t missed; /* periods before it that had no tick at all */
};

void app_start(struct app *app, const struct dcmp_config *config, enum dcmp_carrier carrier, struct fault_log *log,
               int32_t failure, uint32_t now_us);

/* How many periods had no tick, by a clock that runs freely between the edges of two ticks. */
uint32_t app_missed(uint32_t between_us, uint32_t period_us);

/* One period. */
struct dcmp_output app_tick(struct app *app, const struct app_tick *tick);

/* Between two ticks: what has come in over the byte port. */
struct dcmp_output app_serve_bytes(struct app *app, uint32_t now_us);

/* The byte that every frame of the byte port ends with. */
uint8_t app_frame_end(const struct app *app);

/* Put what there is to say into `sending`. */
void app_say(struct app *app);

/* The board has failed. */
struct dcmp_output app_fail(struct app *app, enum dcmp_fault_code code, int32_t detail, uint32_t now_us);

/* Log a fault that the log does not have yet; to be called after the device was changed directly. */
struct dcmp_output app_settle(struct app *app, uint32_t now_us);

#endif
