/* The one translation unit of a program that holds the library's implementation. */
#define GTAO_IMPLEMENTATION
#define GTSO_IMPLEMENTATION
#include "gtao.h"
#include "gtso.h"
