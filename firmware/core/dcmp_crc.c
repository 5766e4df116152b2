/* Half a byte at a time: 16 entries are as quick as a small target needs, and 256 would be flash for nothing. */
#include "dcmp_crc.h"

/* Entry i: i * x^8 modulo the polynomial (0x2F, 0x1021). */
static const uint8_t crc8_table[16] = {0x00, 0x2F, 0x5E, 0x71, 0xBC, 0x93, 0xE2, 0xCD,
                                       0x57, 0x78, 0x09, 0x26, 0xEB, 0xC4, 0xB5, 0x9A};
static const uint16_t crc16_table[16] = {0x0000, 0x1021, 0x2042, 0x3063, 0x4084, 0x50A5, 0x60C6, 0x70E7,
                                         0x8108, 0x9129, 0xA14A, 0xB16B, 0xC18C, 0xD1AD, 0xE1CE, 0xF1EF};

static uint8_t crc8_nibble(uint8_t crc)
{
    return (uint8_t)(((uint32_t)crc << 4) ^ crc8_table[crc >> 4]);
}

static uint16_t crc16_nibble(uint16_t crc)
{
    return (uint16_t)(((uint32_t)crc << 4) ^ crc16_table[crc >> 12]);
}

uint8_t dcmp_crc8_add(uint8_t crc, uint8_t byte)
{
    return crc8_nibble(crc8_nibble((uint8_t)(crc ^ byte)));
}

uint8_t dcmp_crc8(const uint8_t *bytes, size_t length)
{
    uint8_t crc = DCMP_CRC8_START;
    for (size_t i = 0; i < length; i++) {
        crc = dcmp_crc8_add(crc, bytes[i]);
    }
    return (uint8_t)(crc ^ 0xFFu);
}

uint16_t dcmp_crc16(const uint8_t *bytes, size_t length)
{
    uint16_t crc = DCMP_CRC16_START;
    for (size_t i = 0; i < length; i++) {
        crc = crc16_nibble(crc16_nibble((uint16_t)(crc ^ ((uint32_t)bytes[i] << 8))));
    }
    return crc;
}
