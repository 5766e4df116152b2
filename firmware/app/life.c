#include "life.h"

bool life_goes_on(const struct life *life, struct life *seen)
{
    const uint32_t ticks = life->ticks;
    const uint32_t receptions = life->receptions;
    const uint32_t decisions = life->decisions;
    if (ticks == seen->ticks || receptions == seen->receptions || decisions == seen->decisions) {
        return false;
    }
    seen->ticks = ticks;
    seen->receptions = receptions;
    seen->decisions = decisions;
    return true;
}
