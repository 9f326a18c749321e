/* gtao_compute with memory of its own, exactly as large as asked for: what suites and benches do where one image is all
 * they want. */
#ifndef GTAO_TESTS_COMPUTE_H
#define GTAO_TESTS_COMPUTE_H

#include <stdlib.h>

#include "gtao.h"

static inline gtao_result compute_output(const gtao_desc *desc, const gtao_output *output) {
    const size_t size = gtao_scratch_size(desc);
    void *scratch = malloc(size ? size : 1);
    const gtao_result status = scratch ? gtao_compute(desc, output, scratch, size, NULL) : GTAO_ERROR_SCRATCH;
    free(scratch);
    return status;
}

#endif
