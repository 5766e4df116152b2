/* The plant port: how a simulated plant plays encoder, amplifier and sample clock of a board.
 *
 * A stream of bytes each way: a socket, a pipe pair, a serial port. Fixed sizes, little-endian, no framing: both sides
 * start together and nothing is lost on the way.
 *
 * The plant says when a tick happens. TICK, 12 bytes:
 *
 *    at  type  name
 *     0  u32   now_us     the board's clock at this tick
 *     4  u32   counts     the encoder's counter
 *     8  u16   wait_ms    answer once the host has, or after so long (wall time); 0: at once. A device that is armed is
 *                         answered by a DRIVE computed from this tick's SAMPLE, any other by any frame
 *    10  u8    flags      bit 0, plant time: the board's clock stands still until the next TICK;
 *                         otherwise it runs on with the wall, at most one period
 *    11  u8    0
 *
 * The board answers each with one OUTPUT, and sends one more whenever its output changes between two ticks (a disarm, a
 * fault, the host gone): the newest is what the amplifier has to do. 20 bytes:
 *
 *     0  u32   now_us     the board's clock as this is sent
 *     4  u32   since_us   the board's clock as the output became what it is
 *     8  u32   fed_us     the board's clock as the watchdog was fed for the last time
 *    12  i16   voltage_mV
 *    14  u8    enable     0 or 1
 *    15  u8    state      as in SAMPLE
 *    16  u16   owner      session that owns the device, 0 for none
 *    18  u8    fault      code latched, or of the last one
 *    19  u8    flags      bit 0: no TICK asked for it; bit 1: a host has the link open
 *
 * The end of the stream ends the board. */
#ifndef PLANT_PORT_H
#define PLANT_PORT_H

#include <stdbool.h>
#include <stdint.h>

#define PLANT_TICK_BYTES 12u
#define PLANT_OUTPUT_BYTES 20u

struct plant_tick {
    uint32_t now_us;
    uint32_t counts;
    uint16_t wait_ms;
    bool plant_time;
};

struct plant_output {
    uint32_t now_us;
    uint32_t since_us;
    uint32_t fed_us;
    int16_t voltage_mV;
    bool enable;
    uint8_t state;
    uint16_t owner;
    uint8_t fault;
    bool unasked;
    bool link_up;
};

void plant_unpack_tick(const uint8_t bytes[PLANT_TICK_BYTES], struct plant_tick *tick);
void plant_pack_output(const struct plant_output *output, uint8_t bytes[PLANT_OUTPUT_BYTES]);

#endif
