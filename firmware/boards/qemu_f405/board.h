/* The chip in QEMU. The program is in this folder, too: the emulator has no encoder and no amplifier. */
#ifndef BOARD_H
#define BOARD_H

#define BOARD_NUMBER 4
#define BOARD_PACKAGE_PINS 64u
#define BOARD_CRYSTAL_HZ 8000000u
#define BOARD_FLASH_KIB 1024u
#define BOARD_RAM_KIB 128u

#define BOARD_ENABLE PB15

#endif
