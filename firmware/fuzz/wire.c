#include "wire.h"

#include <string.h>

#define COBS_LONGEST 13u
#define SLCAN_LONGEST 31u
#define CR 0x0Du

static uint8_t crc8_of[256];
static uint16_t crc16_of[256];

void wire_prepare(void)
{
    for (uint32_t byte = 0; byte < 256u; byte++) {
        uint32_t eight = byte;
        uint32_t sixteen = byte << 8;
        for (int i = 0; i < 8; i++) {
            eight = (eight << 1) ^ ((eight & 0x80u) != 0u ? 0x12Fu : 0u);
            sixteen = (sixteen << 1) ^ ((sixteen & 0x8000u) != 0u ? 0x11021u : 0u);
        }
        crc8_of[byte] = (uint8_t)eight;
        crc16_of[byte] = (uint16_t)sixteen;
    }
}

static uint16_t crc16(const uint8_t *bytes, size_t length)
{
    uint32_t crc = 0xFFFFu;
    for (size_t i = 0; i < length; i++) {
        crc = ((crc << 8) & 0xFFFFu) ^ crc16_of[(crc >> 8) ^ bytes[i]];
    }
    return (uint16_t)crc;
}

uint8_t wire_crc8(const struct dcmp_frame *frame)
{
    uint32_t crc = crc8_of[0xFFu ^ (frame->id & 0xFFu)];
    crc = crc8_of[crc ^ (frame->id >> 8)];
    for (uint32_t i = 0; i + 1u < frame->length; i++) {
        crc = crc8_of[crc ^ frame->data[i]];
    }
    return (uint8_t)(crc ^ 0xFFu);
}

uint8_t wire_length_from_host(uint32_t number)
{
    switch (number) {
    case WIRE_STOP:
    case WIRE_GET:
        return 2;
    case WIRE_HELLO:
        return 7;
    case WIRE_DRIVE:
    case WIRE_SET:
        return 8;
    default:
        return 0;
    }
}

struct dcmp_frame wire_begin(enum wire_number number, uint32_t node)
{
    struct dcmp_frame frame = {.id = (uint16_t)((uint32_t)number * 16u + node % 16u), .length = 0};
    memset(frame.data, 0, sizeof frame.data);
    return frame;
}

void wire_put(struct dcmp_frame *frame, uint32_t value, uint32_t bytes)
{
    for (uint32_t i = 0; i < bytes; i++) {
        frame->data[frame->length++] = (uint8_t)(value >> (8u * i));
    }
}

void wire_seal(struct dcmp_frame *frame)
{
    frame->length++;
    frame->data[frame->length - 1u] = wire_crc8(frame);
}

uint32_t wire_get(const struct dcmp_frame *frame, uint32_t at, uint32_t bytes)
{
    uint32_t value = 0;
    while (bytes-- > 0u) {
        value = value * 256u + frame->data[at + bytes];
    }
    return value;
}

/* ------------------------------------------------------------------------------------------- COBS */

size_t wire_cobs(const struct dcmp_frame *frame, uint8_t bytes[WIRE_BYTES_MAX])
{
    uint8_t plain[13] = {(uint8_t)(frame->id & 0xFFu), (uint8_t)(frame->id >> 8)};
    const size_t end = 2u + frame->length;
    memcpy(&plain[2], frame->data, frame->length);
    const uint16_t crc = crc16(plain, end);
    plain[end] = (uint8_t)(crc & 0xFFu);
    plain[end + 1u] = (uint8_t)(crc >> 8);
    size_t written = 0;
    for (size_t from = 0; from <= end + 2u;) { /* stretches without 0, each behind its length and one more */
        size_t to = from;
        while (to < end + 2u && plain[to] != 0u) {
            to++;
        }
        bytes[written++] = (uint8_t)(to - from + 1u);
        memcpy(&bytes[written], &plain[from], to - from);
        written += to - from;
        from = to + 1u;
    }
    bytes[written++] = 0;
    return written;
}

static enum wire_heard end_of_cobs(const struct wire_ear *ear, struct dcmp_frame *frame)
{
    uint8_t plain[COBS_LONGEST];
    uint32_t length = 0;
    if (ear->length == 0u) {
        return WIRE_NOTHING;
    }
    if (ear->length > COBS_LONGEST) {
        return WIRE_CORRUPT;
    }
    for (uint32_t at = 0; at < ear->length;) {
        const uint32_t next = at + ear->bytes[at];
        if (next > ear->length) {
            return WIRE_CORRUPT;
        }
        for (uint32_t i = at + 1u; i < next; i++) {
            plain[length++] = ear->bytes[i];
        }
        if (next < ear->length) {
            plain[length++] = 0;
        }
        at = next;
    }
    if (length < 5u || length > 12u || plain[1] > 7u) {
        return WIRE_CORRUPT;
    }
    if (crc16(plain, length - 2u) != (uint32_t)plain[length - 2u] + 256u * plain[length - 1u]) {
        return WIRE_CORRUPT;
    }
    frame->id = (uint16_t)(plain[0] + 256u * plain[1]);
    frame->length = (uint8_t)(length - 4u);
    memset(frame->data, 0, sizeof frame->data);
    memcpy(frame->data, &plain[2], frame->length);
    return WIRE_FRAME;
}

/* ------------------------------------------------------------------------------------------ slcan */

size_t wire_slcan(const struct dcmp_frame *frame, uint8_t bytes[WIRE_BYTES_MAX])
{
    static const char hex[] = "0123456789ABCDEF";
    const uint8_t head[] = {'t', (uint8_t)hex[(frame->id >> 8) & 15u], (uint8_t)hex[(frame->id >> 4) & 15u],
                            (uint8_t)hex[frame->id & 15u], (uint8_t)hex[frame->length]};
    size_t written = sizeof head;
    memcpy(bytes, head, sizeof head);
    for (uint32_t i = 0; i < frame->length; i++) {
        bytes[written++] = (uint8_t)hex[frame->data[i] >> 4];
        bytes[written++] = (uint8_t)hex[frame->data[i] & 15u];
    }
    bytes[written++] = CR;
    return written;
}

/* The number that digits of upper-case hex are, -1 if one is none. */
static int64_t number(const uint8_t *digits, uint32_t count)
{
    int64_t value = 0;
    for (uint32_t i = 0; i < count; i++) {
        const uint8_t c = digits[i];
        const int digit = c >= '0' && c <= '9' ? c - '0' : (c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1);
        if (digit < 0) {
            return -1;
        }
        value = value * 16 + digit;
    }
    return value;
}

/* t, T, r, R: the letter, an identifier, a length, data for t and T. */
static enum wire_heard end_of_message(const struct wire_ear *ear, struct dcmp_frame *frame)
{
    const uint8_t *line = ear->bytes;
    const bool extended = line[0] == 'T' || line[0] == 'R';
    const bool remote = line[0] == 'r' || line[0] == 'R';
    const uint32_t digits = extended ? 8u : 3u;
    if (ear->length < digits + 2u) {
        return WIRE_CORRUPT;
    }
    const int64_t id = number(&line[1], digits);
    const int64_t length = number(&line[1u + digits], 1);
    if (id < 0 || id > (extended ? 0x1FFFFFFF : 0x7FF) || length < (line[0] == 't' ? 1 : 0) || length > 8) {
        return WIRE_CORRUPT;
    }
    if (ear->length != digits + 2u + (remote ? 0u : 2u * (uint32_t)length)) {
        return WIRE_CORRUPT;
    }
    struct dcmp_frame said = wire_begin(WIRE_STOP, 0);
    said.id = (uint16_t)(id & 0x7FF);
    for (uint32_t i = 0; i < (remote ? 0u : (uint32_t)length); i++) {
        const int64_t byte = number(&line[2u + digits + 2u * i], 2);
        if (byte < 0) {
            return WIRE_CORRUPT;
        }
        wire_put(&said, (uint32_t)byte, 1);
    }
    if (line[0] == 't') {
        *frame = said;
    }
    return line[0] == 't' ? WIRE_FRAME : WIRE_NOTHING;
}

static enum wire_heard answer(struct wire_ear *ear, const char *text)
{
    ear->replied = (uint32_t)strlen(text);
    memcpy(ear->reply, text, ear->replied);
    return WIRE_REPLY;
}

static enum wire_heard end_of_line(struct wire_ear *ear, struct dcmp_frame *frame)
{
    const uint8_t *line = ear->bytes;
    const uint32_t length = ear->length;
    if (length == 0u) {
        return WIRE_NOTHING;
    }
    if (length > SLCAN_LONGEST) {
        return WIRE_CORRUPT;
    }
    if (memchr("tTrR", line[0], 4) != NULL) {
        return end_of_message(ear, frame);
    }
    if (line[0] == 's' && (length == 5u || length == 7u) && number(&line[1], length - 1u) >= 0) {
        return answer(ear, "\r");
    }
    if (line[0] == 'S' && length == 2u && line[1] >= '0' && line[1] <= '9') {
        return answer(ear, "\r");
    }
    if (length != 1u || memchr("COLVNF", line[0], 6) == NULL) {
        return WIRE_CORRUPT;
    }
    switch (line[0]) {
    case 'V':
        return answer(ear, "V0101\r");
    case 'N':
        return answer(ear, "NDCMP\r");
    case 'F':
        return answer(ear, "F00\r");
    default:
        ear->closed = line[0] == 'C';
        return answer(ear, "\r");
    }
}

enum wire_heard wire_hear(struct wire_ear *ear, uint8_t byte, struct dcmp_frame *frame)
{
    if (byte != (ear->slcan ? CR : 0u)) {
        if (ear->length <= (ear->slcan ? SLCAN_LONGEST : COBS_LONGEST)) {
            ear->bytes[ear->length++] = byte;
        }
        return WIRE_NOTHING;
    }
    ear->replied = 0;
    const enum wire_heard heard = ear->slcan ? end_of_line(ear, frame) : end_of_cobs(ear, frame);
    if (ear->slcan && heard == WIRE_CORRUPT) {
        (void)answer(ear, "\a");
    }
    ear->length = 0;
    return heard;
}
