/* app_text - numbers and names as text, without floating point.
 *
 * A fixed-point value becomes a decimal by integer arithmetic, rounded to nearest, halves away
 * from zero, so that the same bytes come out on every machine. A value that rounds to zero has no
 * minus sign.
 */
#ifndef APP_TEXT_H
#define APP_TEXT_H

#include <stddef.h>
#include <stdint.h>

/* Room for any decimal written here. */
#define APP_TEXT_DECIMAL 32

struct app_decimal {
    char text[APP_TEXT_DECIMAL];
};

/* value / 2^fraction_bits; |value| < 2^42, fraction_bits 0..40, decimals 0..6. */
struct app_decimal app_text_fixed(int64_t value, int fraction_bits, int decimals);

/* Angle of a line: thousandths of a degree, 0 .. 179999, to one decimal, below 180.0. */
struct app_decimal app_text_angle(int32_t angle_mdeg);

/* Thousandths of a degree as degrees, to one decimal. */
struct app_decimal app_text_direction(int32_t angle_mdeg);

/* Radians as degrees; decimals as above. */
struct app_decimal app_text_degrees(int32_t angle_rad_q30, int decimals);

/* A name of a setting, at most. */
#define APP_TEXT_NAME_MAX 24

/* Letters to change, insert or leave out to make one name of the other; both of up to
 * APP_TEXT_NAME_MAX bytes. */
int app_text_distance(const char *from, const char *to);

/* Control characters become '?', in place: names from a disk must not steer a terminal. */
void app_text_tame(char *text);

#endif
