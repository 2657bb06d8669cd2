/* ih_score_weights - the curves of ih_score, written by
 *     tools/learn/learn.py --seeds 5001-5060
 * Do not edit. */
#ifndef IH_SCORE_WEIGHTS_H
#define IH_SCORE_WEIGHTS_H

#include "ih_score.h"

/* clang-format off */
struct curve {
    int32_t first_q8, step_q8;     /* evidence at the first knot, and from knot to knot */
    int16_t at_q10[IH_SCORE_KNOTS]; /* part of the log-odds at each knot */
};

static const int32_t bias_q10 = -11787;

static const struct curve curves[IH_EVIDENCE_COUNT] = {
    [IH_EVIDENCE_ON] = {0, 2560, {733, 700, 655, 338, -119, -748, -1559}},
    [IH_EVIDENCE_ROUGH] = {0, 508, {-385, 688, 1140, 666, -112, -762, -1234}},
    [IH_EVIDENCE_BULGE] = {-2787, 1989, {-1874, -1103, 577, 1479, 1164, 346, -589}},
    [IH_EVIDENCE_TALL] = {-7560, 2029, {-2561, -2312, -1881, -1019, 752, 2733, 4288}},
    [IH_EVIDENCE_MOVED] = {0, 7627, {-430, 545, 599, 88, -163, -282, -356}},
    [IH_EVIDENCE_ABOVE] = {12, 40, {-1287, -1239, -1113, -761, 204, 1250, 2946}},
    [IH_EVIDENCE_BESIDE] = {7, 40, {-2901, -1990, -638, 257, 573, 1651, 3048}},
    [IH_EVIDENCE_BELOW] = {4, 40, {1706, 867, 462, 184, -329, -1123, -1767}},
    [IH_EVIDENCE_HIGH] = {7, 41, {-645, -624, -549, -305, 274, 852, 996}},
    [IH_EVIDENCE_NOTHING] = {0, 43, {928, 433, -160, -681, -465, -196, 141}},
    [IH_EVIDENCE_BODY] = {0, 43, {-2587, -1139, -403, 323, 937, 1495, 1375}},
    [IH_EVIDENCE_BODY_RAYS] = {0, 1280, {-556, -823, -858, -537, 44, 942, 1789}},
    [IH_EVIDENCE_BODY_DEPTH] = {-51434, 14088, {-193, -399, 342, 1156, 461, -336, -1031}},
    [IH_EVIDENCE_WIDE] = {0, 43, {249, -103, -387, -335, 118, 321, 136}},
    [IH_EVIDENCE_LEVEL] = {0, 43, {2527, 1275, 240, -506, -923, -1200, -1413}},
    [IH_EVIDENCE_SHOULDER] = {0, 43, {-226, -46, -84, 86, 412, 235, -377}},
    [IH_EVIDENCE_BEFORE] = {0, 2731, {-1507, -49, 110, 97, 317, 517, 516}},
    [IH_EVIDENCE_EXTENT] = {0, 4674, {-545, -425, -72, 287, 466, 313, -24}},
    [IH_EVIDENCE_UPRIGHT] = {87, 112, {-1978, -803, 230, 715, 718, 675, 442}},
};
/* clang-format on */

#endif
