/* What the numerical suites share: comparisons that say by how much they fail. Include once, in the suite's file. */
#ifndef GTAO_TESTS_CHECK_H
#define GTAO_TESTS_CHECK_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* CHECK(condition, "what, with numbers", ...) */
#define CHECK(condition, ...)                                                                                          \
    do {                                                                                                               \
        if (!(condition))                                                                                              \
            fail_msg(__VA_ARGS__);                                                                                     \
    } while (0)

/* CHECK_NEAR(actual, expected, tolerance, "what: format", ...): also fails on NaN. */
#define CHECK_NEAR(actual, expected, tolerance, ...)                                                                   \
    do {                                                                                                               \
        const double check_actual = (double)(actual), check_expected = (double)(expected);                             \
        if (!(fabs(check_actual - check_expected) <= (tolerance))) {                                                   \
            print_message(__VA_ARGS__);                                                                                \
            fail_msg(": %.9g, expected %.9g, off by %.3g, allowed %.3g", check_actual, check_expected,                 \
                     check_actual - check_expected, (double)(tolerance));                                              \
        }                                                                                                              \
    } while (0)

#endif
