/* slcan: lines of upper-case hex. Nothing but the exact form is taken, for a line has no checksum of its own. */
#include "dcmp_slcan.h"

#define CR 0x0Du
#define BEL 0x07u
#define NO_DIGIT 0xFFu
#define LONGEST_COMMAND 7u /* s and 6 digits */

void dcmp_slcan_init(struct dcmp_slcan *slcan)
{
    slcan->length = 0;
    slcan->overlong = false;
    slcan->open = true;
    slcan->reply_length = 0;
}

static uint8_t digit(uint8_t byte)
{
    if (byte >= '0' && byte <= '9') {
        return (uint8_t)(byte - '0');
    }
    if (byte >= 'A' && byte <= 'F') {
        return (uint8_t)(byte - 'A' + 10);
    }
    return NO_DIGIT;
}

static bool all_digits(const struct dcmp_slcan *slcan)
{
    for (size_t i = 1; i < slcan->length; i++) {
        if (digit(slcan->line[i]) == NO_DIGIT) {
            return false;
        }
    }
    return true;
}

/* A letter, an identifier of `id_digits` whose first is at most `top`, a length, and `per_byte` digits for each byte. */
static bool well_formed(const struct dcmp_slcan *slcan, size_t id_digits, uint8_t top, size_t per_byte)
{
    if (slcan->length < id_digits + 2u || !all_digits(slcan) || digit(slcan->line[1]) > top) {
        return false;
    }
    const size_t bytes = digit(slcan->line[id_digits + 1u]);
    return bytes <= DCMP_PAYLOAD_MAX && slcan->length == id_digits + 2u + per_byte * bytes;
}

static uint8_t two_digits(const uint8_t *at)
{
    return (uint8_t)(digit(at[0]) * 16u + digit(at[1]));
}

static enum dcmp_received take_frame(const struct dcmp_slcan *slcan, struct dcmp_frame *frame)
{
    if (!well_formed(slcan, 3, 7, 2) || slcan->line[4] == '0') {
        return DCMP_CORRUPT;
    }
    frame->id = (uint16_t)(digit(slcan->line[1]) * 256u + two_digits(&slcan->line[2]));
    frame->length = digit(slcan->line[4]);
    for (size_t i = 0; i < DCMP_PAYLOAD_MAX; i++) {
        frame->data[i] = i < frame->length ? two_digits(&slcan->line[5u + 2u * i]) : 0u;
    }
    return DCMP_FRAME;
}

static enum dcmp_received answer(struct dcmp_slcan *slcan, const char *text)
{
    uint8_t length = 0;
    while (text[length] != '\0') {
        slcan->reply[length] = (uint8_t)text[length];
        length++;
    }
    slcan->reply[length++] = CR;
    slcan->reply_length = length;
    return DCMP_REPLY;
}

/* The commands of one letter. */
static enum dcmp_received take_letter(struct dcmp_slcan *slcan)
{
    switch (slcan->line[0]) {
    case 'C':
        slcan->open = false;
        return answer(slcan, "");
    case 'O':
    case 'L':
        slcan->open = true;
        return answer(slcan, "");
    case 'V':
        return answer(slcan, "V0101");
    case 'N':
        return answer(slcan, "NDCMP");
    case 'F':
        return answer(slcan, "F00");
    default:
        return DCMP_CORRUPT;
    }
}

static enum dcmp_received take_rate(struct dcmp_slcan *slcan, bool right_form)
{
    return right_form && all_digits(slcan) ? answer(slcan, "") : DCMP_CORRUPT;
}

static enum dcmp_received take_line(struct dcmp_slcan *slcan, struct dcmp_frame *frame)
{
    switch (slcan->line[0]) {
    case 't':
        return take_frame(slcan, frame);
    case 'T':
        return well_formed(slcan, 8, 1, 2) ? DCMP_NOTHING : DCMP_CORRUPT;
    case 'r':
        return well_formed(slcan, 3, 7, 0) ? DCMP_NOTHING : DCMP_CORRUPT;
    case 'R':
        return well_formed(slcan, 8, 1, 0) ? DCMP_NOTHING : DCMP_CORRUPT;
    case 'S':
        return take_rate(slcan, slcan->length == 2u && slcan->line[1] <= '9');
    case 's':
        return take_rate(slcan, slcan->length == 5u || slcan->length == LONGEST_COMMAND);
    default:
        return slcan->length == 1u ? take_letter(slcan) : DCMP_CORRUPT;
    }
}

static enum dcmp_received finish(struct dcmp_slcan *slcan, struct dcmp_frame *frame)
{
    enum dcmp_received received = DCMP_CORRUPT;
    slcan->reply_length = 0;
    if (!slcan->overlong) {
        received = slcan->length == 0u ? DCMP_NOTHING : take_line(slcan, frame);
    }
    if (received == DCMP_CORRUPT) {
        slcan->reply[0] = BEL;
        slcan->reply_length = 1;
    }
    slcan->length = 0;
    slcan->overlong = false;
    return received;
}

enum dcmp_received dcmp_slcan_receive(struct dcmp_slcan *slcan, uint8_t byte, struct dcmp_frame *frame)
{
    if (byte == CR) {
        return finish(slcan, frame);
    }
    if (slcan->length == DCMP_SLCAN_LINE_MAX) {
        slcan->overlong = true;
    } else {
        slcan->line[slcan->length++] = byte;
    }
    return DCMP_NOTHING;
}

static size_t put_byte(uint8_t *bytes, uint8_t value)
{
    static const char digits[] = "0123456789ABCDEF";
    bytes[0] = (uint8_t)digits[value >> 4];
    bytes[1] = (uint8_t)digits[value & 0xFu];
    return 2;
}

size_t dcmp_slcan_send(const struct dcmp_frame *frame, uint8_t bytes[DCMP_SLCAN_ENCODED_MAX])
{
    size_t length = 3;
    bytes[0] = 't';
    bytes[1] = (uint8_t)('0' + (frame->id >> 8));
    (void)put_byte(&bytes[2], (uint8_t)(frame->id & 0xFFu));
    bytes[4] = (uint8_t)('0' + frame->length);
    length += 2u;
    for (size_t i = 0; i < frame->length; i++) {
        length += put_byte(&bytes[length], frame->data[i]);
    }
    bytes[length] = CR;
    return length + 1u;
}
