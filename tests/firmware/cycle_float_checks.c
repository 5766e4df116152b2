#define DCMP_REAL_FLOAT
#include "cycle_checks.c"
