#define DCMP_REAL_FLOAT
#include "cause_checks.c"
