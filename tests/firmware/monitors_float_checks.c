#define DCMP_REAL_FLOAT
#include "monitors_checks.c"
