/* The translation unit with the implementation, after the declarations have already been seen. */
#include "gtao.h"

#define GTAO_IMPLEMENTATION
#include "gtao.h"

/* Once more must change nothing. */
#include "gtao.h"
