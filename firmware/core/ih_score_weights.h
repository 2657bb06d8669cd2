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

static const int32_t bias_q10 = -11716;

static const struct curve curves[IH_EVIDENCE_COUNT] = {
    [IH_EVIDENCE_ON] = {0, 2475, {372, 526, 657, 406, 91, -570, -1481}},
    [IH_EVIDENCE_ROUGH] = {0, 509, {-275, 743, 1132, 595, -237, -848, -1109}},
    [IH_EVIDENCE_BULGE] = {-2781, 1996, {-1853, -1197, 697, 1616, 1118, 251, -631}},
    [IH_EVIDENCE_TALL] = {-7560, 2026, {-2922, -2528, -1896, -791, 1005, 2820, 4312}},
    [IH_EVIDENCE_MOVED] = {0, 7667, {-370, 630, 767, 123, -237, -406, -507}},
    [IH_EVIDENCE_ABOVE] = {12, 40, {-978, -992, -1037, -960, -13, 1049, 2932}},
    [IH_EVIDENCE_BESIDE] = {7, 40, {-3183, -2155, -704, 337, 780, 1744, 3181}},
    [IH_EVIDENCE_BELOW] = {5, 40, {1641, 854, 512, 230, -273, -1159, -1805}},
    [IH_EVIDENCE_HIGH] = {8, 41, {-542, -577, -574, -372, 218, 801, 1046}},
    [IH_EVIDENCE_NOTHING] = {0, 43, {786, 472, -208, -680, -360, -180, 168}},
    [IH_EVIDENCE_BODY] = {0, 43, {-2429, -1146, -564, 280, 962, 1500, 1397}},
    [IH_EVIDENCE_BODY_RAYS] = {0, 1280, {-775, -956, -942, -595, 16, 1076, 2177}},
    [IH_EVIDENCE_BODY_DEPTH] = {-51690, 14094, {-151, -533, -34, 688, 255, -11, -215}},
    [IH_EVIDENCE_WIDE] = {0, 43, {326, -95, -349, -282, 122, 288, -9}},
    [IH_EVIDENCE_LEVEL] = {0, 43, {2396, 1397, 362, -499, -928, -1245, -1482}},
    [IH_EVIDENCE_SHOULDER] = {0, 43, {-245, -121, -130, 131, 474, 278, -386}},
    [IH_EVIDENCE_BEFORE] = {0, 2731, {-1641, -326, -187, 58, 470, 786, 839}},
    [IH_EVIDENCE_EXTENT] = {0, 4674, {-346, -329, -56, 250, 352, 193, -65}},
    [IH_EVIDENCE_UPRIGHT] = {87, 112, {-2179, -790, 310, 732, 752, 710, 465}},
};
/* clang-format on */

#endif
