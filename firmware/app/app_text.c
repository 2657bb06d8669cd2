#include "app_text.h"

#include "hal_text.h"

#define DEG_PER_RAD_Q20 60078980

/* A whole number of 10^-decimals as text. */
static struct app_decimal print_scaled(int64_t scaled, int decimals)
{
    struct app_decimal decimal = {.text = {0}};
    struct hal_text text = hal_text_begin(decimal.text, sizeof decimal.text);
    int64_t unit = 1;
    for (int i = 0; i < decimals; i++) {
        unit *= 10;
    }
    int64_t magnitude = scaled < 0 ? -scaled : scaled;
    hal_text_put(&text, scaled < 0 ? "-" : "");
    hal_text_put_number(&text, magnitude / unit, 1);
    if (decimals > 0) {
        hal_text_put(&text, ".");
        hal_text_put_number(&text, magnitude % unit, decimals);
    }
    return decimal;
}

struct app_decimal app_text_fixed(int64_t value, int fraction_bits, int decimals)
{
    int64_t magnitude = value < 0 ? -value : value;
    for (int i = 0; i < decimals; i++) {
        magnitude *= 10;
    }
    int64_t half = fraction_bits == 0 ? 0 : (int64_t)1 << (fraction_bits - 1);
    int64_t scaled = (magnitude + half) >> fraction_bits;
    return print_scaled(value < 0 ? -scaled : scaled, decimals);
}

struct app_decimal app_text_angle(int32_t angle_mdeg)
{
    int64_t tenths = (angle_mdeg + 50) / 100;
    return print_scaled(tenths % 1800, 1);
}

struct app_decimal app_text_direction(int32_t angle_mdeg)
{
    const int64_t magnitude = angle_mdeg < 0 ? -(int64_t)angle_mdeg : angle_mdeg;
    const int64_t tenths = (magnitude + 50) / 100;
    return print_scaled(angle_mdeg < 0 ? -tenths : tenths, 1);
}

struct app_decimal app_text_degrees(int32_t angle_rad_q30, int decimals)
{
    return app_text_fixed((int64_t)angle_rad_q30 * DEG_PER_RAD_Q20 / (1 << 20), 30, decimals);
}

void app_text_tame(char *text)
{
    for (; *text != 0; text++) {
        unsigned char byte = (unsigned char)*text;
        if (byte < ' ' || byte == 0x7f) {
            *text = '?';
        }
    }
}

static int smaller(int a, int b)
{
    return a < b ? a : b;
}

int app_text_distance(const char *from, const char *to)
{
    int row[APP_TEXT_NAME_MAX + 1];
    const int length = (int)hal_text_length(to);
    for (int k = 0; k <= length; k++) {
        row[k] = k;
    }
    for (int i = 0; from[i] != 0; i++) {
        int diagonal = row[0];
        row[0] = i + 1;
        for (int k = 1; k <= length; k++) {
            int changed = diagonal + (from[i] == to[k - 1] ? 0 : 1);
            diagonal = row[k];
            row[k] = smaller(changed, 1 + smaller(row[k], row[k - 1]));
        }
    }
    return row[length];
}
