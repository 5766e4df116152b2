#define DCMP_REAL_FLOAT
#include "run_phases_checks.c"
