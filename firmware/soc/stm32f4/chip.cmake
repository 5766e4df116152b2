# What an STM32F405 can do, for the check of a board's data (cmake/boards.cmake).

# Which pins each package bonds, by its number of pins (LQFP64, WLCSP90, LQFP100, LQFP144). From modm-devices,
# stm32f4-05_07_15_17.xml, which is made from the vendor's CubeMX data. Of the data sheet (DS8626, table 7) only the rows
# PE2 to PE6, PC13 to PC15 and PF0 were compared: compare the others before a board depends on one of them.
set(PACKAGES 64 90 100 144)
set(PACKAGE_64 "^(P[A-C][0-9]+|PD2)$")
set(PACKAGE_90 "^(P[AB][0-9]+|PC([02367-9]|1[0-5])|PD([0-24-9]|1[0-245])|PE([7-9]|1[0-5]))$")
set(PACKAGE_100 "^P[A-E][0-9]+$")
set(PACKAGE_144 "^P[A-G][0-9]+$")

# DS8626, table 9 (alternate functions).
set(PINS_ENCODER_A PA0 PA5 PA15)
set(PINS_ENCODER_B PA1 PB3)
set(PINS_SERIAL_TX PA9 PB6)
set(PINS_SERIAL_RX PA10 PB7)
set(PINS_CAN_RX PA11 PB8 PD0)
set(PINS_CAN_TX PA12 PB9 PD1)
set(PINS_DAC PA4)
set(PINS_PWM PA8 PE9)
set(PINS_BREAK PA6 PB12 PE15)
set(PINS_PROBE PA13 PA14)
# JTAG has pull-ups on these through a reset (RM0090); the boot loader in ROM drives the rest (AN2606): USART1, USART3,
# CAN2, USB. `tools.flash` runs it by default.
set(PINS_NOT_LOW PA15 PB3 PB4 PA9 PA10 PB10 PB11 PC10 PC11 PB5 PB13 PA11 PA12)

set(CRYSTAL_STEP_HZ 2000000)
set(CRYSTAL_MIN_HZ 4000000)
set(CRYSTAL_MAX_HZ 26000000)
set(FLASH_KIB_MIN 128)
set(FLASH_KIB_MAX 1024)
set(RAM_KIB_MIN 16)
set(RAM_KIB_MAX 128)
