#define DCMP_REAL_FLOAT
#include "elementary_checks.c"
