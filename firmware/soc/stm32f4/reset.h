/* Why the chip started, and how to start it again. */
#ifndef RESET_H
#define RESET_H

#include <stdint.h>

/* As the parameter RESET_CAUSE says it; the next reset is told apart from this one. */
int32_t reset_take_cause(void);

/* Does not return. */
void reset_now(void);

#endif
