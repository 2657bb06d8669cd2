/* ih_score_weights - the curves of ih_score, written by
 *     (experiment)
 * Do not edit. */
#ifndef IH_SCORE_WEIGHTS_H
#define IH_SCORE_WEIGHTS_H

#include "ih_score.h"

/* clang-format off */
struct curve {
    int32_t first_q8, step_q8;     /* evidence at the first knot, and from knot to knot */
    int16_t at_q10[IH_SCORE_KNOTS]; /* part of the log-odds at each knot */
};

static const int32_t bias_q10 = -9763;

static const struct curve curves[IH_EVIDENCE_COUNT] = {
    [IH_EVIDENCE_ON] = {0, 2603, {-797, 128, 802, 796, 232, -315, -846}},
    [IH_EVIDENCE_ROUGH] = {0, 510, {-181, 405, 771, 543, 84, -521, -1102}},
    [IH_EVIDENCE_BULGE] = {-2800, 1931, {-2079, -1077, 457, 1168, 1048, 553, -70}},
    [IH_EVIDENCE_TALL] = {-7560, 2010, {-2119, -1847, -1392, -671, 580, 2129, 3321}},
    [IH_EVIDENCE_MOVED] = {0, 7388, {-282, -23, 150, 127, 62, 6, -39}},
    [IH_EVIDENCE_ABOVE] = {11, 40, {-1047, -1010, -897, -605, -70, 950, 2679}},
    [IH_EVIDENCE_BESIDE] = {7, 40, {-2050, -1390, -727, -98, 319, 1429, 2517}},
    [IH_EVIDENCE_BELOW] = {5, 40, {1410, 868, 411, -26, -470, -922, -1271}},
    [IH_EVIDENCE_HIGH] = {6, 41, {-411, -430, -420, -310, 24, 503, 1044}},
    [IH_EVIDENCE_NOTHING] = {0, 43, {612, 406, -2, -355, -421, -350, 110}},
    [IH_EVIDENCE_BODY] = {0, 43, {-2169, -1106, -478, 147, 764, 1391, 1451}},
    [IH_EVIDENCE_BODY_RAYS] = {0, 1280, {-554, -742, -750, -485, 14, 807, 1710}},
    [IH_EVIDENCE_BODY_DEPTH] = {-51655, 13609, {-259, -342, 363, 1023, 327, -300, -812}},
    [IH_EVIDENCE_WIDE] = {0, 43, {284, -213, -407, -216, 81, 156, 315}},
    [IH_EVIDENCE_LEVEL] = {0, 43, {2426, 1008, 145, -466, -827, -1064, -1222}},
    [IH_EVIDENCE_SHOULDER] = {0, 43, {-389, -205, -123, -21, 279, 390, 70}},
    [IH_EVIDENCE_BEFORE] = {0, 3501, {-1856, -359, 94, 409, 567, 586, 559}},
    [IH_EVIDENCE_EXTENT] = {0, 4674, {-858, -507, -43, 271, 407, 453, 277}},
    [IH_EVIDENCE_UPRIGHT] = {88, 111, {-1805, -475, 415, 782, 801, 435, -154}},
};
/* clang-format on */

#endif
