#define DCMP_REAL_FLOAT
#include "friction_kalman_checks.c"
