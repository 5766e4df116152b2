/* The table that the processor starts from; every board has its own. */
#ifndef VECTORS_H
#define VECTORS_H

#include <stdint.h>

#define VECTORS_EXCEPTIONS 14u /* of the processor itself, behind reset */
#define VECTORS_INTERRUPTS 82u

typedef void vectors_handler(void);

struct vectors {
    const uint32_t *stack;
    vectors_handler *reset;
    vectors_handler *exceptions[VECTORS_EXCEPTIONS];
    vectors_handler *interrupts[VECTORS_INTERRUPTS];
};

extern const struct vectors vectors;

#endif
