/* The entry that libFuzzer and fuzz_main.c share. */
#ifndef FUZZ_PORT_H
#define FUZZ_PORT_H

#include <stddef.h>
#include <stdint.h>

extern uint32_t fuzz_runs; /* inputs in which the device reached RUN */

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
