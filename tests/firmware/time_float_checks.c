#define DCMP_REAL_FLOAT
#include "time_checks.c"
