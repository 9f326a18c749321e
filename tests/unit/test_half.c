/* tests/bench/half.h against the definition of binary16, at every half and at the midpoints between them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/bench/half.h"

/* (-1)^s 2^(e - 15) (1 + m / 1024), or 2^-14 m / 1024. */
static float by_definition(unsigned h) {
    int e = (int)(h >> 10 & 31), m = (int)(h & 1023);
    double v = e ? ldexp(1 + m / 1024.0, e - 15) : ldexp(m / 1024.0, -14);
    return (float)(h & 0x8000 ? -v : v);
}

static void finite_halves_are_exact(void **state) {
    (void)state;
    for (unsigned h = 0; h < 0x10000; ++h)
        if ((h >> 10 & 31) < 31) {
            assert_true(half_to_float((uint16_t)h) == by_definition(h));
            assert_int_equal(half_from(by_definition(h)), h);
        }
}

static void between_them_to_the_nearest_and_even(void **state) {
    (void)state;
    for (unsigned h = 0; h < 0x7c00; ++h) {
        /* Beyond the largest half the next one would be 65536. */
        float low = by_definition(h), high = h < 0x7bff ? by_definition(h + 1) : 65536.0f, middle = (low + high) / 2;
        unsigned even = h & 1 ? h + 1 : h;
        assert_int_equal(half_from(middle), even);
        assert_int_equal(half_from(-middle), even | 0x8000);
        assert_int_equal(half_from(nextafterf(middle, 0)), h);
        assert_int_equal(half_from(nextafterf(middle, HUGE_VALF)), h + 1);
    }
}

static void infinities_and_nan(void **state) {
    (void)state;
    assert_int_equal(half_from(HUGE_VALF), 0x7c00);
    assert_int_equal(half_from(-1e30f), 0xfc00);
    assert_true(half_to_float(0x7c00) == HUGE_VALF && half_to_float(0xfc00) == -HUGE_VALF);
    assert_true(isnan(half_to_float(half_from(NAN))) && isnan(half_to_float(0x7e01)));
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(finite_halves_are_exact),
                                       cmocka_unit_test(between_them_to_the_nearest_and_even),
                                       cmocka_unit_test(infinities_and_nan)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
