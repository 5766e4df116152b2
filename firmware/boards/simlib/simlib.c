/* The simulated rig of one run as a shared library, a whole period per call. */
#include "simlib.h"

#define API __attribute__((visibility("default")))

API size_t simlib_size(void);
API void simlib_plant(struct simlib *sim);
API void simlib_advance(struct simlib *sim);
API void simlib_read(struct simlib *sim);
API void simlib_sample(struct simlib *sim);

size_t simlib_size(void)
{
    return sizeof(struct simlib);
}

void simlib_plant(struct simlib *sim)
{
    plant_period(sim);
}

void simlib_advance(struct simlib *sim)
{
    rig_period(sim);
}

void simlib_read(struct simlib *sim)
{
    rig_read(sim);
}

void simlib_sample(struct simlib *sim)
{
    rig_sample(sim);
}
