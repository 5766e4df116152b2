/* The bench board with an analogue amplifier. firmware/README.md says what each line means. */
#ifndef BOARD_H
#define BOARD_H

#define BOARD_NUMBER 3
#define BOARD_PACKAGE_PINS 64u
#define BOARD_CRYSTAL_HZ 8000000u
#define BOARD_FLASH_KIB 1024u
#define BOARD_RAM_KIB 128u

#define BOARD_ENABLE PB15
#define BOARD_ENCODER_A PA0
#define BOARD_ENCODER_B PA1
#define BOARD_SERIAL_TX PA9
#define BOARD_SERIAL_RX PA10
#define BOARD_CAN_RX PB8
#define BOARD_CAN_TX PB9
#define BOARD_DAC PA4

#endif
