#include "ih_basis.h"

/* Eight at once; compilers do not look up tables with vectors by themselves. */
#ifdef __AVX2__
#include <immintrin.h>
#endif

/* 2^30 / sqrt(m) for m in 2^29 .. 2^31, in spans of 2^23: the value at a span's beginning, lowered by half of
 * what a chord lies above the curve, Q3 with a half for rounding, times 2^12, plus the fall over the span, Q3.
 * What is read between entries and cut to a whole number is at most 2^-15 of it off. Written by
 * tools/oracle/basis_table.py. */
static const uint32_t inverse_root[] = {
    1518500655, 1506777837, 1495317167, 1484118642, 1473165880, 1462450687, 1451968969, 1441708437,
    1431660898, 1421822257, 1412184322, 1402738901, 1393477800, 1384401022, 1375500372, 1366763564,
    1358194693, 1349785568, 1341532091, 1333426072, 1325463413, 1317644116, 1309964083, 1302411028,
    1294993141, 1287698135, 1280521914, 1273468574, 1266529923, 1259701864, 1252980302, 1246369333,
    1239860764, 1233454596, 1227146733, 1220933078, 1214813632, 1208784298, 1202845077, 1196991872,
    1191220588, 1185535320, 1179931973, 1174406450, 1168954656, 1163580686, 1158280445, 1153049836,
    1147892955, 1142801610, 1137779898, 1132819627, 1127928987, 1123095692, 1118327934, 1113617519,
    1108968545, 1104376915, 1099842630, 1095361592, 1090937899, 1086563359, 1082246162, 1077974022,
    1073755130, 1069585390, 1065464803, 1061389271, 1057362892, 1053381569, 1049441207, 1045549996,
    1041695650, 1037890456, 1034122126, 1030394756, 1026708346, 1023062897, 1019454312, 1015882591,
    1012347734, 1008849741, 1005392708, 1001964348, 998572851,  995218219,  991896355,  988607259,
    985346835,  982123276,  978928388,  975766269,  972632821,  969532142,  966460135,  963412704,
    960398041,  957412051,  954450636,  951521989,  948613823,  945734328,  942883506,  940057260,
    937255590,  934478496,  931725978,  928998036,  926290575,  923611785,  920953475,  918319742,
    915706488,  913113715,  910545518,  908001897,  905474660,  902967902,  900485721,  898019925,
    895578704,  893153867,  890749510,  888365634,  885998141,  883651128,  881324596,  879014448,
    876720683,  874447399,  872190499,  869954078,  867729946,  865526294,  863334930,  861164046,
    859009546,  856871430,  854745603,  852640255,  850547195,  848470519,  846406132,  844362224,
    842326509,  840311273,  838308326,  836317666,  834343391,  832381403,  830435800,  828502485,
    826581458,  824676814,  822784459,  820900296,  819032517,  817181122,  815337919,  813507004,
    811688377,  809882038,  808087987,  806306224,  804536749,  802779563,  801030568,  799297957,
    797573538,  795857312,  794157469,  792465818,  790782360,  789115285,  787452307,  785805712,
    784167310,  782537099,  780919177,  779309446,  777712004,  776122754,  774545791,  772977021,
    771416443,  769864056,  768323958,  766792052,  765268338,  763752815,  762249581,  760754539,
};
#define SPANS_BELOW 64 /* of 2^23, below 2^29 */

/* How the root of s, with 2^32 <= s < 2^45, is found, in 32 bits; n = 16 sqrt(s), at most 2^26.5.
 *
 * m = s * 4^e / 2^14, cut off, with e so that m is in 2^29 .. 2^31. r: 2^30 / sqrt(m) from the table. A first
 * root of m is m r / 2^30, with 16 bits of m and half a bit more: with all rounding off by 2^-13.4 of it.
 * What its square lacks of m, times r / 2^31, leaves 2^-27.1 of it, and what the two roundings there do: n =
 * root * 2^11 / 2^e is less than 0.9 / 2^e off before it is rounded itself, to nearest for e = 0 and at most
 * 0.75 below for others. So the nearest whole number is n or one beside it, which its square tells: the lower
 * 32 bits of the difference are enough. */
#define ROOT_ROUNDING 33152 /* 2^14, and half of an r of the middle */
#define MORE_ROUNDING 32768 /* 2^14, and as much for what was cut off the lack */

#ifdef __AVX2__

#define EACH(value) _mm256_set1_epi32(value)

/* e: half of the leading zeros of s / 2^14 in 31 bits. */
static inline __m256i zeros_halved(__m256i high)
{
    __m256i below = _mm256_cmpgt_epi32(EACH(1 << 29), high); /* -1 where it is */
    for (int bit = 27; bit >= 19; bit -= 2) {
        below = _mm256_add_epi32(below, _mm256_cmpgt_epi32(EACH(1 << bit), high));
    }
    return _mm256_sub_epi32(_mm256_setzero_si256(), below);
}

static inline __m256i read_inverse(__m256i m)
{
    const __m256i at = _mm256_sub_epi32(_mm256_srli_epi32(m, 23), EACH(SPANS_BELOW));
    const __m256i entry = _mm256_i32gather_epi32((const int *)inverse_root, at, 4);
    const __m256i part_q16 = _mm256_and_si256(_mm256_srli_epi32(m, 7), EACH(0xffff));
    const __m256i fall = _mm256_mullo_epi32(_mm256_and_si256(entry, EACH(0xfff)), part_q16);
    return _mm256_srli_epi32(
        _mm256_sub_epi32(_mm256_srli_epi32(entry, 12), _mm256_srli_epi32(fall, 16)), 3);
}

/* n or one beside it. */
static inline __m256i near_root(__m256i high, __m256i low)
{
    const __m256i e = zeros_halved(high);
    const __m256i twice = _mm256_add_epi32(e, e);
    const __m256i m = _mm256_or_si256(
        _mm256_sllv_epi32(high, twice),
        _mm256_srlv_epi32(_mm256_slli_epi32(low, 18), _mm256_sub_epi32(EACH(32), twice)));
    const __m256i r = read_inverse(m);
    const __m256i product = _mm256_mullo_epi32(_mm256_srli_epi32(m, 15), r);
    const __m256i root = _mm256_srli_epi32(_mm256_add_epi32(product, EACH(ROOT_ROUNDING)), 15);
    const __m256i lack = _mm256_sub_epi32(m, _mm256_mullo_epi32(root, root));
    const __m256i wanted = _mm256_mullo_epi32(_mm256_srai_epi32(lack, 4), r);
    const __m256i more = _mm256_srai_epi32(_mm256_add_epi32(wanted, EACH(MORE_ROUNDING)), 15);
    const __m256i fine = _mm256_add_epi32(_mm256_slli_epi32(root, 12), more);
    const __m256i one = EACH(1);
    return _mm256_srlv_epi32(_mm256_add_epi32(fine, one), _mm256_add_epi32(e, one));
}

static inline __m256i lower_halves(__m256i a, __m256i b)
{
    /* of a and b by turns, two each: undone at the end */
    const __m256i a_low = _mm256_shuffle_epi32(a, 0x88);
    const __m256i b_low = _mm256_shuffle_epi32(b, 0x88);
    return _mm256_unpacklo_epi64(a_low, b_low);
}

static inline void roots_of_eight(const uint64_t *square_q32, uint32_t *root_q20)
{
    const __m256i a = _mm256_loadu_si256((const __m256i *)square_q32);
    const __m256i b = _mm256_loadu_si256((const __m256i *)&square_q32[4]);
    const __m256i low = lower_halves(a, b);
    const __m256i n =
        near_root(lower_halves(_mm256_srli_epi64(a, 14), _mm256_srli_epi64(b, 14)), low);
    const __m256i rest = _mm256_sub_epi32(_mm256_slli_epi32(low, 8), _mm256_mullo_epi32(n, n));
    const __m256i is_less = _mm256_cmpgt_epi32(rest, n); /* -1 where it is */
    const __m256i is_not_more =
        _mm256_cmpgt_epi32(rest, _mm256_sub_epi32(_mm256_setzero_si256(), n));
    const __m256i nearest =
        _mm256_sub_epi32(_mm256_sub_epi32(_mm256_sub_epi32(n, EACH(1)), is_not_more), is_less);
    _mm256_storeu_si256((__m256i *)root_q20, _mm256_permute4x64_epi64(nearest, 0xD8));
}

void ih_basis_roots(const uint64_t *square_q32, int32_t count, uint32_t *root_q20)
{
    for (int32_t i = 0; i < count; i += IH_BASIS_GROUP) {
        roots_of_eight(&square_q32[i], &root_q20[i]);
    }
}

#else

/* n or one beside it. */
static inline int32_t near_root(uint64_t square_q32)
{
    const uint32_t high = (uint32_t)(square_q32 >> 14);
    const uint32_t rest = (uint32_t)(square_q32 & 0x3fff)
                          << 17; /* the bits below, from bit 30 on */
    const uint32_t e = ((uint32_t)__builtin_clz(high) - 1) / 2;
    const uint32_t m = high << 2 * e | rest >> (31 - 2 * e);
    const uint32_t entry = inverse_root[(m >> 23) - SPANS_BELOW];
    const uint32_t fall = (entry & 0xfff) * (m >> 7 & 0xffff) >> 16;
    const int32_t r = (int32_t)(((entry >> 12) - fall) >> 3);
    const int32_t root = ((int32_t)(m >> 15) * r + ROOT_ROUNDING) >> 15;
    const int32_t lack = (int32_t)((int64_t)m - (int64_t)root * root);
    const int32_t more = ((lack >> 4) * r + MORE_ROUNDING) >> 15;
    return ((root << 12) + more + 1) >> (e + 1);
}

void ih_basis_roots(const uint64_t *square_q32, int32_t count, uint32_t *root_q20)
{
    for (int32_t i = 0; i < count; i++) {
        const int32_t n = near_root(square_q32[i]);
        const int32_t rest =
            (int32_t)((int64_t)(square_q32[i] << 8) - (int64_t)n * n); /* below 3 n */
        root_q20[i] = (uint32_t)(n + (rest > n) - (rest <= -n));
    }
}

#endif
