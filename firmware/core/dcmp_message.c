/* Which frames are messages, and their crc8. */
#include "dcmp_message.h"

#include "dcmp_crc.h"

struct layout {
    uint8_t length;
    bool from_host;
};

/* By message number, the identifier of node 0 divided by 16; a number without a message has length 0. */
static const struct layout layouts[] = DCMP_LAYOUTS;

/* Over the identifier too: a frame whose identifier was damaged is not taken for another message. */
static uint8_t checksum(const struct dcmp_frame *frame)
{
    uint8_t crc = dcmp_crc8_add(DCMP_CRC8_START, (uint8_t)(frame->id & 0xFFu));
    crc = dcmp_crc8_add(crc, (uint8_t)(frame->id >> 8));
    for (uint8_t i = 0; i + 1u < frame->length; i++) {
        crc = dcmp_crc8_add(crc, frame->data[i]);
    }
    return (uint8_t)(crc ^ 0xFFu);
}

enum dcmp_checked dcmp_check_any(const struct dcmp_frame *frame, uint8_t node)
{
    const size_t number = frame->id >> 4;
    if ((frame->id & 0xFu) != node || number >= sizeof layouts / sizeof layouts[0] || layouts[number].length == 0u) {
        return DCMP_FOREIGN;
    }
    if (frame->length != layouts[number].length) {
        return DCMP_FOREIGN;
    }
    return frame->data[frame->length - 1u] == checksum(frame) ? DCMP_GENUINE : DCMP_DAMAGED;
}

enum dcmp_checked dcmp_check(const struct dcmp_frame *frame, uint8_t node)
{
    const enum dcmp_checked checked = dcmp_check_any(frame, node);
    return checked != DCMP_FOREIGN && layouts[frame->id >> 4].from_host ? checked : DCMP_FOREIGN;
}

void dcmp_seal(struct dcmp_frame *frame, enum dcmp_message message, uint8_t node)
{
    const size_t number = (size_t)message >> 4;
    frame->id = (uint16_t)((uint32_t)message + node);
    frame->length = layouts[number].length;
    for (size_t i = frame->length; i < DCMP_PAYLOAD_MAX; i++) {
        frame->data[i] = 0;
    }
    frame->data[frame->length - 1u] = checksum(frame);
}
