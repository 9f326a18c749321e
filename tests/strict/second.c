/* A second translation unit; with GTAO_STATIC it carries a copy of its own, of which it uses next to nothing. */
#include "gtao.h"
#include "gtso.h"

int strict_second_unit(void);

int strict_second_unit(void) {
    return gtao_isa_available(GTAO_ISA_SCALAR) && gtso_cos_aperture(1.0f) == 0.0f;
}
