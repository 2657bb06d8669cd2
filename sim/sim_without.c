#include "sim_without.h"

#include <stddef.h>
#include <string.h>

static void without_scan(struct ih_params *params)
{
    params->detections.scan.candidate_max = 0;
}

static void without_nests(struct ih_params *params)
{
    params->detections.nest_max = 0;
}

static void without_expected(struct ih_params *params)
{
    params->detections.expected_max = 0;
}

static void without_fit(struct ih_params *params)
{
    params->detections.fit.step_count = 0;
}

static void without_tracks(struct ih_params *params)
{
    params->tracks.gap_us = -1;
}

static void without_windows(struct ih_params *params)
{
    params->windows.window_max = 1;
}

static void without_missing(struct ih_params *params)
{
    params->samples.fill_root_weight_q15 = 0;
}

/* Index of the part that is no parameter. */
#define PART_AMBIENT 0

static const struct {
    const char *name;
    void (*apply)(struct ih_params *params); /* NULL: none */
} part[] = {
    {"ambient", NULL},
    {"scan", without_scan},
    {"nests", without_nests},
    {"expected", without_expected},
    {"fit", without_fit},
    {"tracks", without_tracks},
    {"windows", without_windows},
    {"missing", without_missing},
};

#define PART_COUNT (sizeof part / sizeof part[0])

/* The part of a name of this length; PART_COUNT when there is none. */
static size_t find(const char *name, size_t length)
{
    size_t i = 0;
    while (i < PART_COUNT &&
           (strlen(part[i].name) != length || strncmp(part[i].name, name, length) != 0)) {
        i++;
    }
    return i;
}

const char *sim_without_add(uint32_t *parts, const char *list)
{
    for (const char *name = list; name != NULL;) {
        size_t length = strcspn(name, ",");
        size_t index = find(name, length);
        if (index == PART_COUNT) {
            return name;
        }
        *parts |= UINT32_C(1) << index;
        name = name[length] == ',' ? name + length + 1 : NULL;
    }
    return NULL;
}

void sim_without_apply(uint32_t parts, struct ih_params *params)
{
    for (size_t i = 0; i < PART_COUNT; i++) {
        if ((parts >> i & 1) != 0 && part[i].apply != NULL) {
            part[i].apply(params);
        }
    }
}

bool sim_without_ambient(uint32_t parts)
{
    return (parts >> PART_AMBIENT & 1) != 0;
}
