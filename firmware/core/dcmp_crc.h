/* The two checksums of docs/protocol.md. */
#ifndef DCMP_CRC_H
#define DCMP_CRC_H

#include <stddef.h>
#include <stdint.h>

#define DCMP_CRC8_START 0xFFu
#define DCMP_CRC16_START 0xFFFFu

/* CRC-8/AUTOSAR without its final exclusive-or, to be carried from piece to piece. */
uint8_t dcmp_crc8_add(uint8_t crc, uint8_t byte);

/* CRC-8/AUTOSAR: the last step inverts. */
uint8_t dcmp_crc8(const uint8_t *bytes, size_t length);

/* CRC-16/IBM-3740. */
uint16_t dcmp_crc16(const uint8_t *bytes, size_t length);

#endif
