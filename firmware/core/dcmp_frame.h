/* A classic CAN frame, over any link. */
#ifndef DCMP_FRAME_H
#define DCMP_FRAME_H

#include <stdint.h>

#define DCMP_PAYLOAD_MAX 8u

struct dcmp_frame {
    uint16_t id;     /* 11 bits: message number * 16 + node */
    uint8_t length;  /* bytes of data in use, 0..8 */
    uint8_t data[DCMP_PAYLOAD_MAX];
};

/* What a receiver made of a byte. */
enum dcmp_received {
    DCMP_NOTHING, /* more bytes are needed */
    DCMP_FRAME,   /* a frame is complete */
    DCMP_CORRUPT, /* something that was no frame has ended */
    DCMP_REPLY    /* slcan only: a command wants its answer sent */
};

#endif
