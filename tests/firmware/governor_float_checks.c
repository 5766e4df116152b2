#define DCMP_REAL_FLOAT
#include "governor_checks.c"
