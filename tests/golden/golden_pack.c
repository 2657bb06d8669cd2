/* golden_pack OUT FILE... - rigs (rig.json) and frames (PGM) as the one file that golden reads.
 * The frames that follow a rig are of this rig. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app_rig.h"
#include "golden.h"
#include "hal_file.h"
#include "replay/hal_pgm.h"

static void write_word(FILE *out, uint32_t word)
{
    for (int shift = 0; shift < 32; shift += 8) {
        putc((int)(word >> shift & 0xff), out);
    }
}

static bool pack_rig(FILE *out, const char *path, struct hal_error *error)
{
    struct ih_calibration calibration;
    if (!app_rig_load(path, &calibration, error)) {
        return false;
    }
    write_word(out, GOLDEN_RIG);
    write_word(out, (uint32_t)calibration.kind);
    const char *words = golden_rig_words(&calibration);
    for (size_t i = 0; i < GOLDEN_RIG_WORDS; i++) {
        uint32_t word = 0;
        memcpy(&word, words + i * sizeof word, sizeof word);
        write_word(out, word);
    }
    return true;
}

static void write_samples(FILE *out, const struct hal_pgm *pgm, const uint8_t *data)
{
    size_t count = (size_t)pgm->width * (size_t)pgm->height;
    if (pgm->bytes_per_sample == 1) {
        fwrite(data, 1, count, out);
        return;
    }
    for (size_t i = 0; i < count; i++) {
        uint16_t sample = 0;
        memcpy(&sample, data + 2 * i, sizeof sample);
        putc(sample & 0xff, out);
        putc(sample >> 8, out);
    }
}

static bool pack_frame(FILE *out, const char *path, struct hal_error *error)
{
    uint8_t *data = NULL;
    size_t size = 0;
    struct hal_pgm pgm;
    if (!hal_file_read(path, HAL_PGM_FILE_MAX, &data, &size, error)) {
        return false;
    }
    bool good = hal_pgm_decode(data, size, &pgm, error);
    if (good) {
        write_word(out, GOLDEN_FRAME);
        write_word(out, (uint32_t)pgm.width);
        write_word(out, (uint32_t)pgm.height);
        write_word(out, (uint32_t)pgm.bytes_per_sample);
        write_word(out, (uint32_t)pgm.maximum);
        write_samples(out, &pgm, data);
    }
    free(data);
    return good;
}

static bool ends_with(const char *text, const char *end)
{
    size_t length = strlen(text), end_length = strlen(end);
    return length >= end_length && strcmp(text + length - end_length, end) == 0;
}

int main(int argument_count, char **arguments)
{
    if (argument_count < 3) {
        fputs("usage: golden_pack OUT FILE...\n", stderr);
        return 2;
    }
    FILE *out = fopen(arguments[1], "wb");
    if (out == NULL) {
        perror(arguments[1]);
        return 1;
    }
    write_word(out, GOLDEN_MAGIC);
    for (int i = 2; i < argument_count; i++) {
        struct hal_error error;
        const char *path = arguments[i];
        if (!(ends_with(path, ".json") ? pack_rig : pack_frame)(out, path, &error)) {
            fprintf(stderr, "golden_pack: %s: %s\n", path, error.text);
            fclose(out);
            return 1;
        }
    }
    write_word(out, GOLDEN_END);
    bool written = ferror(out) == 0;
    if (fclose(out) != 0 || !written) {
        perror(arguments[1]);
        return 1;
    }
    return 0;
}
