/* ih_score_weights - the curves of ih_score, written by
 *     tools/learn/learn.py --seeds 5001-5060
 * Do not edit. */
#ifndef IH_SCORE_WEIGHTS_H
#define IH_SCORE_WEIGHTS_H

#include <stdint.h>

#include "detect/ih_evidence.h"
#include "detect/ih_score.h"

/* clang-format off */
static const int32_t bias_q10 = -11711;

static const struct ih_score_curve curves[IH_EVIDENCE_COUNT] = {
    [IH_EVIDENCE_ON] = {0, 2475, {252, 503, 660, 415, 132, -532, -1430}},
    [IH_EVIDENCE_ROUGH] = {0, 509, {-430, 742, 1160, 599, -250, -816, -1004}},
    [IH_EVIDENCE_BULGE] = {-2782, 1996, {-1848, -1163, 751, 1648, 1133, 203, -725}},
    [IH_EVIDENCE_TALL] = {-7560, 2023, {-2865, -2472, -1845, -765, 995, 2752, 4200}},
    [IH_EVIDENCE_MOVED] = {0, 7663, {-363, 655, 772, 106, -250, -412, -507}},
    [IH_EVIDENCE_ABOVE] = {12, 40, {-999, -1001, -1025, -940, 1, 1051, 2912}},
    [IH_EVIDENCE_BESIDE] = {7, 40, {-3158, -2113, -679, 335, 739, 1706, 3169}},
    [IH_EVIDENCE_BELOW] = {5, 40, {1625, 858, 508, 204, -296, -1160, -1740}},
    [IH_EVIDENCE_HIGH] = {8, 41, {-534, -567, -563, -364, 218, 796, 1013}},
    [IH_EVIDENCE_NOTHING] = {0, 43, {787, 460, -220, -677, -332, -191, 173}},
    [IH_EVIDENCE_BODY] = {0, 43, {-2383, -1124, -548, 265, 933, 1492, 1364}},
    [IH_EVIDENCE_BODY_RAYS] = {0, 1280, {-741, -932, -941, -622, -23, 1082, 2178}},
    [IH_EVIDENCE_BODY_DEPTH] = {-51731, 14120, {-145, -503, 6, 708, 242, -33, -274}},
    [IH_EVIDENCE_WIDE] = {0, 43, {308, -116, -346, -263, 144, 311, -39}},
    [IH_EVIDENCE_LEVEL] = {0, 43, {2375, 1390, 357, -477, -911, -1242, -1492}},
    [IH_EVIDENCE_SHOULDER] = {0, 43, {-233, -111, -152, 120, 508, 300, -432}},
    [IH_EVIDENCE_BEFORE] = {0, 2731, {-1642, -319, -179, 63, 466, 792, 818}},
    [IH_EVIDENCE_EXTENT] = {0, 4674, {-340, -335, -80, 231, 361, 212, -51}},
    [IH_EVIDENCE_UPRIGHT] = {88, 112, {-2142, -787, 300, 716, 741, 715, 458}},
};
/* clang-format on */

#endif
