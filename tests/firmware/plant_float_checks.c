#define DCMP_REAL_FLOAT
#include "plant_checks.c"
