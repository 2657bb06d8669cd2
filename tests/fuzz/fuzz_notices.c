/* No target: something wrong of each kind that the others are to be stopped by (notices.sh). Input: its
 * letter. */
#include "fuzz.h"

#define SIZE 8

/* The compiler warns of such a conversion where it sees it. */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
static uint8_t narrow_of(uint32_t number)
{
    return number;
}
#pragma GCC diagnostic pop

/* volatile: what is wrong must not be compiled away, or become an error of the build. */
static void break_rule(uint8_t rule)
{
    volatile int32_t number = INT32_MAX;
    volatile uint32_t zero = 0;
    volatile double large = 1e10;
    volatile uint8_t narrow = 0;
    switch (rule) {
    case 'a': { /* address */
        volatile uint8_t *bytes = malloc(SIZE);
        FUZZ_CHECK(bytes != NULL);
        narrow = bytes[SIZE + (size_t)zero];
        free((void *)bytes);
        break;
    }
    case 'u': /* undefined: signed overflow */
        number = number + 1;
        break;
    case 'w': /* unsigned wrap-around */
        zero = zero - 1;
        break;
    case 't': /* a conversion that loses bits */
        narrow = narrow_of(zero + 1000);
        break;
    case 'f': /* floating point out of an integer's range */
        number = (int32_t)large;
        break;
    case 'c': /* a check */
        FUZZ_CHECK(zero == 1);
        break;
    default:
        break;
    }
    (void)narrow;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_input input = {data, size};
    break_rule(fuzz_byte(&input));
    return 0;
}
