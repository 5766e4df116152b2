/* The encoder on TIM2: 32 bits, four counts a line, latched at every tick by the sample clock itself; and the time of
 * the newest rising edge of A, which TIM2 passes on to the microsecond counter. No software is in the way of either. */
#ifndef QUADRATURE_H
#define QUADRATURE_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_device.h"

/* After timebase_start, before timebase_start_ticks. */
void quadrature_start(void);

/* The count at the newest tick. */
uint32_t quadrature_latched(void);

/* The newest edge before the tick that was at `tick_us`; not seen if there was none since the one taken before. */
struct dcmp_edge quadrature_edge(uint32_t tick_us);

#endif
