/* The translation unit with the implementations, after the declarations have already been seen. */
#include "gtso.h"

#define GTAO_IMPLEMENTATION
#define GTSO_IMPLEMENTATION
#include "gtao.h"
#include "gtso.h"

/* Once more must change nothing. */
#include "gtao.h"
#include "gtso.h"
