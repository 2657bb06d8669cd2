/* ih_score_weights - the curves of ih_score, written by
 *     tools/learn/learn.py --seeds 5001-5024 --people people-1 people-2 people-3 learn
 * Do not edit. */
#ifndef IH_SCORE_WEIGHTS_H
#define IH_SCORE_WEIGHTS_H

#include <stdint.h>

#include "detect/ih_evidence.h"
#include "detect/ih_score.h"

/* clang-format off */
static const int32_t bias_q10 = -5042;

static const struct ih_score_curve curves[IH_EVIDENCE_COUNT] = {
    [IH_EVIDENCE_ON] = {0, 3586, {-1734, -1496, -599, 28, 509, 1426, 1865}},
    [IH_EVIDENCE_ROUGH] = {0, 643, {-999, 196, 970, 698, -53, -336, -475}},
    [IH_EVIDENCE_BULGE] = {-3800, 2244, {-2658, -1559, 606, 2065, 1309, 463, -225}},
    [IH_EVIDENCE_TALL] = {-3566, 1534, {-2248, -1181, -426, 643, 1200, 1089, 923}},
    [IH_EVIDENCE_MOVED] = {417, 3481, {-338, -233, -292, 220, 422, 381, -160}},
    [IH_EVIDENCE_ABOVE] = {9, 40, {-981, -817, -605, -398, 53, 640, 2108}},
    [IH_EVIDENCE_BESIDE] = {6, 40, {-1837, -1281, -546, 610, 703, 876, 1475}},
    [IH_EVIDENCE_BELOW] = {4, 41, {322, 290, 522, 313, -180, -629, -638}},
    [IH_EVIDENCE_HIGH] = {5, 42, {-533, -278, 11, 259, 121, 109, 310}},
    [IH_EVIDENCE_NOTHING] = {0, 43, {35, -336, -697, -423, -2, 325, 1098}},
    [IH_EVIDENCE_BODY] = {0, 43, {-1321, -913, -563, -228, 426, 1079, 1519}},
    [IH_EVIDENCE_BODY_RAYS] = {0, 1280, {812, -101, -110, 122, 108, -110, -721}},
    [IH_EVIDENCE_BODY_DEPTH] = {-49570, 13368, {274, 525, 881, 960, -19, -827, -1795}},
    [IH_EVIDENCE_WIDE] = {0, 43, {326, -35, -141, 93, 73, -88, -227}},
    [IH_EVIDENCE_LEVEL] = {0, 34, {710, -48, -370, -288, -100, 29, 67}},
    [IH_EVIDENCE_SHOULDER] = {0, 43, {-101, 90, -111, -104, 19, 182, 24}},
    [IH_EVIDENCE_BEFORE] = {0, 3072, {-2396, -872, -545, 128, 641, 1220, 1824}},
    [IH_EVIDENCE_EXTENT] = {0, 3387, {22, -150, -29, 115, 92, 12, -62}},
    [IH_EVIDENCE_UPRIGHT] = {90, 113, {-1330, -271, 190, 427, 432, 236, 316}},
    [IH_EVIDENCE_SURROUNDINGS] = {-518, 260, {-4151, -3743, -2812, -587, 2167, 3894, 5234}},
};
/* clang-format on */

#endif
