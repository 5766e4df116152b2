/* CAN 1 at 1 Mbit/s, standard identifiers. */
#ifndef BXCAN_H
#define BXCAN_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_frame.h"

#define BXCAN_TX_IRQ 19u
#define BXCAN_RX0_IRQ 20u
#define BXCAN_SCE_IRQ 22u
#define BXCAN_FIFO 3u /* frames that wait at most */

/* Only frames with one of the identifiers get in. False if the bus clock has no such bit rate, or the
 * controller does not answer. */
bool bxcan_start(uint32_t bus_Hz, const uint16_t *ids, uint32_t count);

/* The next frame; `lost` becomes true if frames were lost because they were not fetched in time. */
bool bxcan_receive(struct dcmp_frame *frame, bool *lost);

/* Whether a frame can be handed over now. */
bool bxcan_has_room(void);
void bxcan_send(const struct dcmp_frame *frame);

/* Give up what waits for the bus: it is older than what follows. False if there was something. */
bool bxcan_abandon(void);

/* Take note of the interrupt that says that a mailbox is empty. */
void bxcan_sent(void);

/* Take note of an error interrupt; whether the controller takes part in the bus. */
bool bxcan_is_on_bus(void);

#endif
