#define DCMP_REAL_FLOAT
#include "control_checks.c"
