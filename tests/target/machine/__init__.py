"""A board with an STM32F405, down to its registers: written from the chip's manual, not from the firmware."""
