#define DCMP_REAL_FLOAT
#include "limiter_checks.c"
