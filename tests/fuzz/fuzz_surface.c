/* The surface through any samples, its contours, nests and hypotheses, as by default and as the paper's method needs it.
 * Input: rig, field, samples. */
#include <string.h>

#include "fuzz_check.h"
#include "fuzz_rig.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct ih_samples samples;
    static struct ih_surface surface;
    static struct ih_surface_scratch surface_scratch;
    static struct ih_nests nests;
    static struct ih_nests_scratch hypotheses_scratch;
    static struct ih_hypotheses hypotheses;
    struct fuzz_input input = {data, size};
    struct ih_params params;
    struct ih_field field;
    const struct ih_rig *rig = fuzz_tables_rig(&input);
    fuzz_tables_field(&input, &field);
    fuzz_tables_samples(&input, &samples);
    for (int variant = 0; variant < 2; variant++) {
        if (variant == 0) {
            ih_params_default(&params);
        } else {
            ih_params_paper(&params);
        }
        memset(&surface_scratch, 0xa5, sizeof surface_scratch);
        ih_surface_fit(&samples, &field, &params.surface, &surface_scratch, &surface);
        fuzz_check_surface(&surface, &samples);
        ih_nests_find(&surface, &params.nests, &hypotheses_scratch, &nests);
        fuzz_check_hypotheses(&nests, &surface, &params.nests);
        ih_hypotheses_select(&nests, &surface, &samples, rig, &params.hypotheses, &hypotheses);
        fuzz_check_heads(&hypotheses, &nests, &samples);
    }
    return 0;
}
