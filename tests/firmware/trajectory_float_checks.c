#define DCMP_REAL_FLOAT
#include "trajectory_checks.c"
