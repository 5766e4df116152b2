/* Consistent Overhead Byte Stuffing for frames of at most 12 bytes: the long code 0xFF never occurs. */
#include "dcmp_cobs.h"

#include "dcmp_crc.h"

#define DECODED_MIN 5u /* identifier, one byte of payload, crc16 */
#define DECODED_MAX 12u

void dcmp_cobs_init(struct dcmp_cobs *cobs)
{
    cobs->length = 0;
    cobs->overlong = false;
}

/* Writes at most length - 1 bytes; returns how many, 0 if a code points past the end. */
static size_t decode(const uint8_t *bytes, size_t length, uint8_t *decoded)
{
    size_t written = 0;
    size_t code_at = 0;
    for (size_t i = 1; i <= length; i++) {
        if (i < code_at + bytes[code_at]) {
            if (i == length) {
                return 0;
            }
            decoded[written++] = bytes[i];
        } else if (i < length) {
            decoded[written++] = 0;
            code_at = i;
        } else {
            /* nothing is behind the last code */
        }
    }
    return written;
}

static bool parse(const struct dcmp_cobs *cobs, struct dcmp_frame *frame)
{
    uint8_t decoded[DECODED_MAX];
    const size_t length = decode(cobs->bytes, cobs->length, decoded);
    if (length < DECODED_MIN) {
        return false;
    }
    const size_t end = length - 2u;
    const uint16_t crc = (uint16_t)(decoded[end] | ((uint32_t)decoded[end + 1u] << 8));
    if (crc != dcmp_crc16(decoded, end) || decoded[1] > 7u) {
        return false;
    }
    frame->id = (uint16_t)(decoded[0] | ((uint32_t)decoded[1] << 8));
    frame->length = (uint8_t)(end - 2u);
    for (size_t i = 0; i < DCMP_PAYLOAD_MAX; i++) {
        frame->data[i] = i + 2u < end ? decoded[i + 2u] : 0u;
    }
    return true;
}

static enum dcmp_received finish(struct dcmp_cobs *cobs, struct dcmp_frame *frame)
{
    enum dcmp_received received = DCMP_CORRUPT;
    if (!cobs->overlong) {
        if (cobs->length == 0u) {
            received = DCMP_NOTHING;
        } else if (parse(cobs, frame)) {
            received = DCMP_FRAME;
        } else {
            /* damaged */
        }
    }
    dcmp_cobs_init(cobs);
    return received;
}

enum dcmp_received dcmp_cobs_receive(struct dcmp_cobs *cobs, uint8_t byte, struct dcmp_frame *frame)
{
    if (byte == 0u) {
        return finish(cobs, frame);
    }
    if (cobs->length == sizeof cobs->bytes) {
        cobs->overlong = true;
    } else {
        cobs->bytes[cobs->length++] = byte;
    }
    return DCMP_NOTHING;
}

static size_t encode(const uint8_t *decoded, size_t length, uint8_t *bytes)
{
    size_t code_at = 0;
    uint8_t code = 1;
    for (size_t i = 0; i < length; i++) {
        if (decoded[i] == 0u) {
            bytes[code_at] = code;
            code_at = i + 1u;
            code = 1;
        } else {
            bytes[i + 1u] = decoded[i];
            code++;
        }
    }
    bytes[code_at] = code;
    bytes[length + 1u] = 0;
    return length + 2u;
}

size_t dcmp_cobs_send(const struct dcmp_frame *frame, uint8_t bytes[DCMP_COBS_ENCODED_MAX])
{
    uint8_t decoded[DECODED_MAX];
    const size_t end = frame->length + 2u;
    decoded[0] = (uint8_t)(frame->id & 0xFFu);
    decoded[1] = (uint8_t)(frame->id >> 8);
    for (size_t i = 0; i < frame->length; i++) {
        decoded[i + 2u] = frame->data[i];
    }
    const uint16_t crc = dcmp_crc16(decoded, end);
    decoded[end] = (uint8_t)(crc & 0xFFu);
    decoded[end + 1u] = (uint8_t)(crc >> 8);
    return encode(decoded, end + 2u, bytes);
}
