#define DCMP_REAL_FLOAT
#include "random_checks.c"
