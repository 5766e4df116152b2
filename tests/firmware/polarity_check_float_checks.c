#define DCMP_REAL_FLOAT
#include "polarity_check_checks.c"
