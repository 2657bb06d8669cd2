#include "surface/ih_multiquadric.h"

#include <stdbool.h>

/* Compilers do not look up tables with vectors by themselves, nor find the multiplication of lower halves. */
#if defined __x86_64__ && defined __SSE2__
#include <immintrin.h>
#endif

/* sqrt(m) * 2^16 for m in 2^30 .. 2^32, in spans of 2^22, and at the last one's end: with g the place in a span,
 * 0 .. 65535, and rise the difference to the next value >> 6, value + (rise * g >> 10) is less than 2^-21.8 of it
 * off. Written by tools/oracle/multiquadric_table.py. */
static const uint32_t roots[] = {
    2147484207, 2151674420, 2155856488, 2160030460, 2164196382, 2168354300, 2172504260, 2176646308,
    2180780489, 2184906848, 2189025428, 2193136274, 2197239429, 2201334935, 2205422837, 2209503175,
    2213575992, 2217641329, 2221699227, 2225749727, 2229792869, 2233828693, 2237857239, 2241878545,
    2245892652, 2249899597, 2253899418, 2257892154, 2261877842, 2265856519, 2269828221, 2273792987,
    2277750851, 2281701850, 2285646019, 2289583393, 2293514009, 2297437899, 2301355099, 2305265643,
    2309169564, 2313066897, 2316957674, 2320841928, 2324719692, 2328590999, 2332455880, 2336314368,
    2340166494, 2344012289, 2347851785, 2351685012, 2355512002, 2359332784, 2363147388, 2366955844,
    2370758183, 2374554433, 2378344624, 2382128784, 2385906942, 2389679127, 2393445366, 2397205689,
    2400960122, 2404708694, 2408451431, 2412188361, 2415919511, 2419644907, 2423364576, 2427078545,
    2430786839, 2434489485, 2438186507, 2441877933, 2445563786, 2449244093, 2452918877, 2456588165,
    2460251980, 2463910348, 2467563291, 2471210835, 2474853002, 2478489818, 2482121305, 2485747486,
    2489368386, 2492984026, 2496594430, 2500199620, 2503799620, 2507394450, 2510984135, 2514568694,
    2518148152, 2521722528, 2525291845, 2528856124, 2532415387, 2535969654, 2539518946, 2543063285,
    2546602692, 2550137185, 2553666787, 2557191517, 2560711395, 2564226441, 2567736676, 2571242118,
    2574742788, 2578238705, 2581729888, 2585216356, 2588698129, 2592175225, 2595647664, 2599115463,
    2602578641, 2606037217, 2609491210, 2612940636, 2616385515, 2619825864, 2623261701, 2626693044,
    2630119910, 2633542318, 2636960283, 2640373824, 2643782957, 2647187700, 2650588069, 2653984082,
    2657375755, 2660763105, 2664146147, 2667524900, 2670899378, 2674269598, 2677635576, 2680997328,
    2684354870, 2687708217, 2691057386, 2694402392, 2697743251, 2701079977, 2704412587, 2707741094,
    2711065516, 2714385865, 2717702158, 2721014409, 2724322633, 2727626845, 2730927059, 2734223290,
    2737515551, 2740803858, 2744088225, 2747368665, 2750645193, 2753917822, 2757186567, 2760451442,
    2763712459, 2766969634, 2770222978, 2773472507, 2776718232, 2779960168, 2783198328, 2786432725,
    2789663371, 2792890281, 2796113466, 2799332941, 2802548716, 2805760807, 2808969224, 2812173980,
    2815375089, 2818572562, 2821766412, 2824956651, 2828143291, 2831326345, 2834505824, 2837681741,
    2840854107, 2844022935, 2847188236, 2850350022, 2853508304, 2856663095, 2859814406, 2862962248,
    2866106632, 2869247571, 2872385075, 2875519156, 2878649825, 2881777092, 2884900970, 2888021468,
    2891138599, 2894252372, 2897362799, 2900469891, 2903573657, 2906674109, 2909771258, 2912865114,
    2915955687, 2919042988, 2922127027, 2925207814, 2928285360, 2931359676, 2934430770, 2937498654,
    2940563337, 2943624829, 2946683141, 2949738281, 2952790261, 2955839089, 2958884776, 2961927331,
    2964966764, 2968003084, 2971036301, 2974066425, 2977093464, 2980117429, 2983138329, 2986156172,
    2989170969, 2992182728, 2995191459, 2998197170, 3001199871, 3004199571, 3007196279, 3010190003,
    3013180754, 3016168538, 3019153366, 3022135246, 3025114186, 3028090196, 3031063284, 3034033459,
    3037000729, 3039965102, 3042926588, 3045885194, 3048840929, 3051793802, 3054743820, 3057690992,
    3060635326, 3063576831, 3066515513, 3069451383, 3072384446, 3075314713, 3078242190, 3081166886,
    3084088808, 3087007964, 3089924363, 3092838011, 3095748918, 3098657089, 3101562534, 3104465260,
    3107365274, 3110262585, 3113157198, 3116049123, 3118938367, 3121824936, 3124708839, 3127590083,
    3130468675, 3133344622, 3136217932, 3139088612, 3141956669, 3144822111, 3147684944, 3150545175,
    3153402813, 3156257863, 3159110332, 3161960229, 3164807559, 3167652330, 3170494548, 3173334221,
    3176171355, 3179005956, 3181838033, 3184667591, 3187494637, 3190319178, 3193141221, 3195960772,
    3198777837, 3201592424, 3204404538, 3207214187, 3210021377, 3212826113, 3215628404, 3218428255,
    3221225672, 3224020661, 3226813230, 3229603384, 3232391130, 3235176473, 3237959421, 3240739978,
    3243518152, 3246293949, 3249067374, 3251838433, 3254607133, 3257373480, 3260137480, 3262899138,
    3265658461, 3268415454, 3271170123, 3273922475, 3276672515, 3279420249, 3282165682, 3284908821,
    3287649671, 3290388238, 3293124527, 3295858545, 3298590297, 3301319788, 3304047025, 3306772012,
    3309494755, 3312215261, 3314933533, 3317649579, 3320363403, 3323075010, 3325784407, 3328491598,
    3331196589, 3333899385, 3336599992, 3339298415, 3341994659, 3344688730, 3347380632, 3350070372,
    3352757953, 3355443382, 3358126663, 3360807802, 3363486804, 3366163674, 3368838417, 3371511037,
    3374181541, 3376849933, 3379516218, 3382180401, 3384842487, 3387502481, 3390160388, 3392816213,
    3395469960, 3398121635, 3400771243, 3403418787, 3406064274, 3408707708, 3411349093, 3413988435,
    3416625737, 3419261006, 3421894245, 3424525459, 3427154654, 3429781832, 3432407000, 3435030162,
    3437651322, 3440270485, 3442887655, 3445502837, 3448116036, 3450727256, 3453336502, 3455943777,
    3458549087, 3461152436, 3463753828, 3466353268, 3468950761, 3471546309, 3474139919, 3476731593,
    3479321337, 3481909155, 3484495052, 3487079030, 3489661095, 3492241251, 3494819502, 3497395853,
    3499970307, 3502542869, 3505113542, 3507682332, 3510249242, 3512814276, 3515377438, 3517938733,
    3520498165, 3523055737, 3525611454, 3528165320, 3530717338, 3533267513, 3535815849, 3538362349,
    3540907018, 3543449860, 3545990878, 3548530076, 3551067459, 3553603031, 3556136794, 3558668753,
    3561198912, 3563727275, 3566253845, 3568778626, 3571301623, 3573822838, 3576342276, 3578859941,
    3581375835, 3583889963, 3586402329, 3588912936, 3591421789, 3593928889, 3596434242, 3598937851,
    3601439720, 3603939851, 3606438250, 3608934919, 3611429861, 3613923082, 3616414583, 3618904370,
    3621392444, 3623878810, 3626363472, 3628846432, 3631327695, 3633807263, 3636285140, 3638761330,
    3641235836, 3643708662, 3646179811, 3648649286, 3651117090, 3653583228, 3656047702, 3658510517,
    3660971674, 3663431178, 3665889032, 3668345239, 3670799802, 3673252726, 3675704012, 3678153665,
    3680601687, 3683048083, 3685492854, 3687936005, 3690377538, 3692817457, 3695255765, 3697692465,
    3700127560, 3702561054, 3704992950, 3707423250, 3709851958, 3712279078, 3714704611, 3717128562,
    3719550933, 3721971728, 3724390949, 3726808600, 3729224683, 3731639202, 3734052160, 3736463559,
    3738873403, 3741281695, 3743688438, 3746093635, 3748497288, 3750899401, 3753299977, 3755699018,
    3758096527, 3760492509, 3762886964, 3765279897, 3767671310, 3770061206, 3772449588, 3774836459,
    3777221822, 3779605679, 3781988034, 3784368889, 3786748247, 3789126111, 3791502483, 3793877367,
    3796250766, 3798622681, 3800993116, 3803362074, 3805729558, 3808095569, 3810460112, 3812823188,
    3815184800, 3817544951, 3819903645, 3822260882, 3824616667, 3826971002, 3829323889, 3831675331,
    3834025331, 3836373892, 3838721016, 3841066705, 3843410963, 3845753792, 3848095195, 3850435174,
    3852773731, 3855110870, 3857446593, 3859780903, 3862113802, 3864445292, 3866775376, 3869104058,
    3871431338, 3873757221, 3876081708, 3878404801, 3880726504, 3883046819, 3885365748, 3887683294,
    3889999459, 3892314246, 3894627657, 3896939695, 3899250362, 3901559660, 3903867592, 3906174161,
    3908479369, 3910783217, 3913085710, 3915386848, 3917686635, 3919985072, 3922282162, 3924577909,
    3926872312, 3929165377, 3931457103, 3933747495, 3936036553, 3938324282, 3940610682, 3942895756,
    3945179507, 3947461936, 3949743047, 3952022841, 3954301321, 3956578488, 3958854346, 3961128896,
    3963402140, 3965674082, 3967944723, 3970214065, 3972482110, 3974748862, 3977014322, 3979278491,
    3981541374, 3983802970, 3986063284, 3988322317, 3990580071, 3992836548, 3995091751, 3997345681,
    3999598342, 4001849734, 4004099860, 4006348723, 4008596324, 4010842665, 4013087749, 4015331578,
    4017574153, 4019815478, 4022055553, 4024294382, 4026531966, 4028768307, 4031003407, 4033237269,
    4035469894, 4037701284, 4039931442, 4042160370, 4044388069, 4046614542, 4048839791, 4051063817,
    4053286623, 4055508210, 4057728582, 4059947739, 4062165683, 4064382418, 4066597944, 4068812263,
    4071025378, 4073237291, 4075448003, 4077657517, 4079865834, 4082072956, 4084278886, 4086483625,
    4088687175, 4090889538, 4093090716, 4095290711, 4097489525, 4099687160, 4101883617, 4104078898,
    4106273006, 4108465942, 4110657708, 4112848307, 4115037739, 4117226007, 4119413112, 4121599057,
    4123783843, 4125967472, 4128149947, 4130331267, 4132511437, 4134690457, 4136868329, 4139045055,
    4141220638, 4143395077, 4145568377, 4147740537, 4149911561, 4152081449, 4154250204, 4156417827,
    4158584321, 4160749686, 4162913925, 4165077040, 4167239032, 4169399902, 4171559654, 4173718287,
    4175875805, 4178032209, 4180187500, 4182341681, 4184494752, 4186646717, 4188797575, 4190947330,
    4193095983, 4195243536, 4197389989, 4199535346, 4201679607, 4203822774, 4205964849, 4208105834,
    4210245730, 4212384539, 4214522263, 4216658903, 4218794461, 4220928938, 4223062337, 4225194658,
    4227325903, 4229456075, 4231585175, 4233713203, 4235840163, 4237966055, 4240090881, 4242214643,
    4244337343, 4246458981, 4248579560, 4250699081, 4252817545, 4254934955, 4257051311, 4259166616,
    4261280871, 4263394078, 4265506237, 4267617352, 4269727422, 4271836450, 4273944437, 4276051386,
    4278157296, 4280262170, 4282366010, 4284468817, 4286570592, 4288671337, 4290771054, 4292869744,
    4294967295,
};
#define SPANS_BELOW 256 /* of 2^22, below 2^30 */
#define SPAN_BITS 22
#define RISE_SHIFT 6
#define PART_SHIFT 10
/* With m = s * 4^e the root of s in Q18 is sqrt(m) / 2^(9 + e), and in Q20 what the table has over 2^(5 + e). */
#define ROOT_SHIFT 5

#ifdef __AVX2__

#define EACH(value) _mm256_set1_epi32(value)

/* e: half of the leading zeros of s, which is 2^18 and more, and below 2^31. */
static inline __m256i zeros_halved(__m256i square)
{
    __m256i e = EACH(6);
    for (int bit = 20; bit <= 30; bit += 2) {
        e = _mm256_add_epi32(e,
                             _mm256_cmpgt_epi32(square, EACH((1 << bit) - 1))); /* -1 where it is */
    }
    return e;
}

static inline __m256i roots_of_eight(__m256i square)
{
    const __m256i e = zeros_halved(square);
    const __m256i m = _mm256_sllv_epi32(square, _mm256_add_epi32(e, e));
    const __m256i at = _mm256_sub_epi32(_mm256_srli_epi32(m, SPAN_BITS), EACH(SPANS_BELOW));
    const int *first = (const int *)&roots[0];
    const int *second = (const int *)&roots[1];
    const __m256i value = _mm256_i32gather_epi32(first, at, sizeof roots[0]);
    const __m256i next = _mm256_i32gather_epi32(second, at, sizeof roots[0]);
    const __m256i rise = _mm256_srli_epi32(_mm256_sub_epi32(next, value), RISE_SHIFT);
    const __m256i g = _mm256_and_si256(_mm256_srli_epi32(m, SPAN_BITS - 16), EACH(0xffff));
    const __m256i more = _mm256_srli_epi32(_mm256_mullo_epi32(rise, g), PART_SHIFT);
    return _mm256_srlv_epi32(_mm256_add_epi32(value, more), _mm256_add_epi32(e, EACH(ROOT_SHIFT)));
}

/* Lines of 12: two of them are three vectors. */
static void roots_by_twelve(const uint32_t *across_q18, const uint32_t *down_q18,
                            int32_t down_count, uint32_t *root_q20)
{
    const __m256i first = _mm256_loadu_si256((const __m256i *)across_q18);
    const __m256i last = _mm256_loadu_si256((const __m256i *)&across_q18[4]);
    const __m256i middle = _mm256_permute2x128_si256(last, first, 0x21);
    __m256i *at = (__m256i *)root_q20;
    for (int32_t k = 0; k < down_count; k += 2) {
        const __m256i here = EACH((int32_t)down_q18[k]);
        const __m256i next = EACH((int32_t)down_q18[k + 1]);
        const __m256i both = _mm256_blend_epi32(here, next, 0xf0);
        _mm256_storeu_si256(&at[0], roots_of_eight(_mm256_add_epi32(first, here)));
        _mm256_storeu_si256(&at[1], roots_of_eight(_mm256_add_epi32(middle, both)));
        _mm256_storeu_si256(&at[2], roots_of_eight(_mm256_add_epi32(last, next)));
        at = &at[3];
    }
}

void ih_multiquadric_roots(const uint32_t *across_q18, int32_t across_count,
                           const uint32_t *down_q18, int32_t down_count, uint32_t *root_q20)
{
    if (across_count != 8) {
        roots_by_twelve(across_q18, down_q18, down_count, root_q20);
        return;
    }
    const __m256i across = _mm256_loadu_si256((const __m256i *)across_q18);
    for (int32_t k = 0; k < down_count; k++) {
        _mm256_storeu_si256((__m256i *)&root_q20[8 * k],
                            roots_of_eight(_mm256_add_epi32(across, EACH((int32_t)down_q18[k]))));
    }
}

#else

static inline uint32_t root_of(uint32_t square_q18)
{
    const uint32_t zeros = (uint32_t)__builtin_clz(square_q18);
    const uint32_t m = square_q18 << (zeros & ~1u);
    const uint32_t *root = &roots[(m >> SPAN_BITS) - SPANS_BELOW];
    const uint32_t g = m >> (SPAN_BITS - 16) & 0xffff;
    const uint32_t rise = (root[1] - root[0]) >> RISE_SHIFT;
    return (root[0] + (rise * g >> PART_SHIFT)) >> (ROOT_SHIFT + zeros / 2);
}

void ih_multiquadric_roots(const uint32_t *across_q18, int32_t across_count,
                           const uint32_t *down_q18, int32_t down_count, uint32_t *root_q20)
{
    for (int32_t k = 0; k < down_count; k++) {
        const uint32_t here_q18 = down_q18[k];
        uint32_t *line_q20 = &root_q20[k * across_count];
        for (int32_t i = 0; i < across_count; i++) {
            line_q20[i] = root_of(across_q18[i] + here_q18);
        }
    }
}

#endif

#if defined __AVX2__

/* Vectors of half a row of nodes that are summed together, and their nodes. */
#define LINE_VECTORS 3
#define LINE_LANES 8

static int64_t sum_one(const uint32_t *basis_q20, const int32_t *coefficient, int32_t term_count)
{
    __m256i sum = _mm256_setzero_si256();
#pragma GCC unroll 4
    for (int32_t i = 0; i < term_count; i += 4) {
        const __m256i basis =
            _mm256_cvtepu32_epi64(_mm_loadu_si128((const __m128i *)&basis_q20[i]));
        const __m256i other =
            _mm256_cvtepi32_epi64(_mm_loadu_si128((const __m128i *)&coefficient[i]));
        sum = _mm256_add_epi64(sum, _mm256_mul_epi32(basis, other));
    }
    int64_t part[4];
    _mm256_storeu_si256((__m256i *)part, sum);
    return part[0] + part[1] + part[2] + part[3];
}

static void add_one(const uint32_t *basis_q20, int32_t factor, int64_t *sum, int32_t term_count)
{
    const __m256i each = EACH(factor);
#pragma GCC unroll 4
    for (int32_t i = 0; i < term_count; i += 4) {
        const __m256i basis =
            _mm256_cvtepu32_epi64(_mm_loadu_si128((const __m128i *)&basis_q20[i]));
        __m256i *at = (__m256i *)&sum[i];
        _mm256_storeu_si256(
            at, _mm256_add_epi64(_mm256_loadu_si256(at), _mm256_mul_epi32(basis, each)));
    }
}

static void sum_four(const uint32_t *basis_q20, const int32_t *coefficient, int32_t term_count,
                     int64_t sum[IH_MULTIQUADRIC_ROWS])
{
    __m256i part[IH_MULTIQUADRIC_ROWS];
    for (int32_t k = 0; k < IH_MULTIQUADRIC_ROWS; k++) {
        part[k] = _mm256_setzero_si256();
    }
    for (int32_t i = 0; i < term_count; i += 8) {
        const __m256i even = _mm256_loadu_si256((const __m256i *)&coefficient[i]);
        const __m256i odd = _mm256_shuffle_epi32(even, 0xf5); /* 1 1 3 3 */
        for (int32_t k = 0; k < IH_MULTIQUADRIC_ROWS; k++) {
            const __m256i basis =
                _mm256_loadu_si256((const __m256i *)&basis_q20[k * term_count + i]);
            const __m256i next = _mm256_shuffle_epi32(basis, 0xf5);
            part[k] = _mm256_add_epi64(part[k], _mm256_mul_epi32(basis, even));
            part[k] = _mm256_add_epi64(part[k], _mm256_mul_epi32(next, odd));
        }
    }
    const __m256i first = _mm256_add_epi64(_mm256_unpacklo_epi64(part[0], part[1]),
                                           _mm256_unpackhi_epi64(part[0], part[1]));
    const __m256i last = _mm256_add_epi64(_mm256_unpacklo_epi64(part[2], part[3]),
                                          _mm256_unpackhi_epi64(part[2], part[3]));
    _mm256_storeu_si256((__m256i *)sum,
                        _mm256_add_epi64(_mm256_permute2x128_si256(first, last, 0x20),
                                         _mm256_permute2x128_si256(first, last, 0x31)));
}

static void add_four(const uint32_t *basis_q20, const int32_t factor[IH_MULTIQUADRIC_ROWS],
                     int64_t *sum, int32_t term_count)
{
    __m256i each[IH_MULTIQUADRIC_ROWS];
    for (int32_t k = 0; k < IH_MULTIQUADRIC_ROWS; k++) {
        each[k] = EACH(factor[k]);
    }
    for (int32_t i = 0; i < term_count; i += 4) {
        __m256i *at = (__m256i *)&sum[i];
        __m256i value = _mm256_loadu_si256(at);
        for (int32_t k = 0; k < IH_MULTIQUADRIC_ROWS; k++) {
            const uint32_t *four = &basis_q20[k * term_count + i];
            const __m256i basis = _mm256_cvtepu32_epi64(_mm_loadu_si128((const __m128i *)four));
            value = _mm256_add_epi64(value, _mm256_mul_epi32(basis, each[k]));
        }
        _mm256_storeu_si256(at, value);
    }
}

/* `vectors` of nodes side by side, which the compiler knows. */
__attribute__((always_inline)) static inline void
sum_lines(const int32_t *coefficient, const int32_t *const *line_q20, int32_t line_count,
          int32_t count, int32_t width, int32_t vectors, int32_t x, int64_t *sum)
{
    __m256i even[LINE_VECTORS], odd[LINE_VECTORS];
    for (int32_t v = 0; v < vectors; v++) {
        even[v] = _mm256_setzero_si256();
        odd[v] = _mm256_setzero_si256();
    }
    for (int32_t k = 0; k < line_count; k++) {
        const int32_t *basis_q20 = &line_q20[k][x];
        for (int32_t i = 0; i < count; i++) {
            const __m256i factor = EACH(coefficient[i]);
            for (int32_t v = 0; v < vectors; v++) {
                const __m256i basis = _mm256_loadu_si256((const __m256i *)&basis_q20[8 * v]);
                const __m256i next = _mm256_shuffle_epi32(basis, 0xf5); /* 1 1 3 3 */
                even[v] = _mm256_add_epi64(even[v], _mm256_mul_epi32(basis, factor));
                odd[v] = _mm256_add_epi64(odd[v], _mm256_mul_epi32(next, factor));
            }
            basis_q20 = &basis_q20[width];
        }
        coefficient = &coefficient[count];
    }
    for (int32_t v = 0; v < vectors; v++) {
        const __m256i first = _mm256_unpacklo_epi64(even[v], odd[v]); /* 0 1, 4 5 */
        const __m256i other = _mm256_unpackhi_epi64(even[v], odd[v]); /* 2 3, 6 7 */
        __m256i *to = (__m256i *)&sum[x + 8 * v];
        _mm256_storeu_si256(&to[0], _mm256_permute2x128_si256(first, other, 0x20));
        _mm256_storeu_si256(&to[1], _mm256_permute2x128_si256(first, other, 0x31));
    }
}

#elif defined __x86_64__ && defined __SSE2__

/* There are only products of numbers without a sign. Here lines are taken for so much more, which the sum of the
 * coefficients times it takes away again. */
#define LINE_MORE (1 << 27)
#define LINE_VECTORS 6
#define LINE_LANES 4

static inline __m128i changed_by(__m128i sum, __m128i product, bool is_less)
{
    return is_less ? _mm_sub_epi64(sum, product) : _mm_add_epi64(sum, product);
}

/* What one coefficient of that size brings. */
__attribute__((always_inline)) static inline void sum_line(const int32_t *basis_q20, __m128i size,
                                                           bool is_less, int32_t vectors,
                                                           __m128i even[LINE_VECTORS],
                                                           __m128i odd[LINE_VECTORS])
{
    const __m128i more = _mm_set1_epi32(LINE_MORE);
    for (int32_t v = 0; v < vectors; v++) {
        const __m128i basis =
            _mm_add_epi32(_mm_loadu_si128((const __m128i *)&basis_q20[4 * v]), more);
        const __m128i next = _mm_srli_epi64(basis, 32);
        even[v] = changed_by(even[v], _mm_mul_epu32(basis, size), is_less);
        odd[v] = changed_by(odd[v], _mm_mul_epu32(next, size), is_less);
    }
}

/* `vectors` of nodes side by side, which the compiler knows. */
__attribute__((always_inline)) static inline void
sum_lines(const int32_t *coefficient, const int32_t *const *line_q20, int32_t line_count,
          int32_t count, int32_t width, int32_t vectors, int32_t x, int64_t *sum)
{
    __m128i even[LINE_VECTORS], odd[LINE_VECTORS];
    int64_t total = 0;
    for (int32_t i = 0; i < line_count * count; i++) {
        total += coefficient[i];
    }
    for (int32_t v = 0; v < vectors; v++) {
        even[v] = odd[v] = _mm_set1_epi64x(-total * LINE_MORE);
    }
    for (int32_t k = 0; k < line_count; k++) {
        const int32_t *basis_q20 = &line_q20[k][x];
        for (int32_t i = 0; i < count; i++) {
            if (coefficient[i] < 0) {
                sum_line(basis_q20, _mm_set1_epi32(-coefficient[i]), true, vectors, even, odd);
            } else {
                sum_line(basis_q20, _mm_set1_epi32(coefficient[i]), false, vectors, even, odd);
            }
            basis_q20 = &basis_q20[width];
        }
        coefficient = &coefficient[count];
    }
    for (int32_t v = 0; v < vectors; v++) {
        __m128i *to = (__m128i *)&sum[x + 4 * v];
        _mm_storeu_si128(&to[0], _mm_unpacklo_epi64(even[v], odd[v]));
        _mm_storeu_si128(&to[1], _mm_unpackhi_epi64(even[v], odd[v]));
    }
}

/* All ones in both words of a half where the first number of the half is negative, and where the second is. */
struct signs {
    __m128i even, odd;
};

static inline struct signs signs_of(__m128i value)
{
    const __m128i sign = _mm_srai_epi32(value, 31);
    const __m128i first = _mm_unpacklo_epi32(sign, sign); /* 0 0 1 1 */
    const __m128i last = _mm_unpackhi_epi32(sign, sign);  /* 2 2 3 3 */
    return (struct signs){_mm_unpacklo_epi64(first, last), _mm_unpackhi_epi64(first, last)};
}

/* Without their signs. */
static inline __m128i size_of(__m128i value)
{
    const __m128i sign = _mm_srai_epi32(value, 31);
    return _mm_sub_epi32(_mm_xor_si128(value, sign), sign);
}

/* Products of sizes are turned where a factor is negative: they then are one less, which is added at the end. */
static void sum_four(const uint32_t *basis_q20, const int32_t *coefficient, int32_t term_count,
                     int64_t sum[IH_MULTIQUADRIC_ROWS])
{
    __m128i part[IH_MULTIQUADRIC_ROWS];
    __m128i less = _mm_setzero_si128();
    for (int32_t k = 0; k < IH_MULTIQUADRIC_ROWS; k++) {
        part[k] = _mm_setzero_si128();
    }
    for (int32_t i = 0; i < term_count; i += 4) {
        const __m128i value = _mm_loadu_si128((const __m128i *)&coefficient[i]);
        const struct signs sign = signs_of(value);
        const __m128i even = size_of(value);
        const __m128i odd = _mm_srli_epi64(even, 32);
        less = _mm_add_epi64(less, _mm_add_epi64(sign.even, sign.odd));
        for (int32_t k = 0; k < IH_MULTIQUADRIC_ROWS; k++) {
            const __m128i basis = _mm_loadu_si128((const __m128i *)&basis_q20[k * term_count + i]);
            const __m128i here = _mm_mul_epu32(basis, even);
            const __m128i next = _mm_mul_epu32(_mm_srli_epi64(basis, 32), odd);
            part[k] = _mm_add_epi64(part[k], _mm_xor_si128(here, sign.even));
            part[k] = _mm_add_epi64(part[k], _mm_xor_si128(next, sign.odd));
        }
    }
    for (int32_t k = 0; k < IH_MULTIQUADRIC_ROWS; k++) {
        int64_t both[2];
        _mm_storeu_si128((__m128i *)both, _mm_sub_epi64(part[k], less));
        sum[k] = both[0] + both[1];
    }
}

static void add_four(const uint32_t *basis_q20, const int32_t factor[IH_MULTIQUADRIC_ROWS],
                     int64_t *sum, int32_t term_count)
{
    __m128i each[IH_MULTIQUADRIC_ROWS], sign[IH_MULTIQUADRIC_ROWS];
    __m128i less = _mm_setzero_si128();
    for (int32_t k = 0; k < IH_MULTIQUADRIC_ROWS; k++) {
        const __m128i value = _mm_set1_epi32(factor[k]);
        each[k] = size_of(value);
        sign[k] = _mm_srai_epi32(value, 31);
        less = _mm_add_epi64(less, sign[k]);
    }
    for (int32_t i = 0; i < term_count; i += 4) {
        __m128i even = _mm_sub_epi64(_mm_setzero_si128(), less);
        __m128i odd = even;
        for (int32_t k = 0; k < IH_MULTIQUADRIC_ROWS; k++) {
            const __m128i basis = _mm_loadu_si128((const __m128i *)&basis_q20[k * term_count + i]);
            const __m128i here = _mm_mul_epu32(basis, each[k]);
            const __m128i next = _mm_mul_epu32(_mm_srli_epi64(basis, 32), each[k]);
            even = _mm_add_epi64(even, _mm_xor_si128(here, sign[k]));
            odd = _mm_add_epi64(odd, _mm_xor_si128(next, sign[k]));
        }
        __m128i *at = (__m128i *)&sum[i];
        const __m128i first = _mm_unpacklo_epi64(even, odd), last = _mm_unpackhi_epi64(even, odd);
        _mm_storeu_si128(&at[0], _mm_add_epi64(_mm_loadu_si128(&at[0]), first));
        _mm_storeu_si128(&at[1], _mm_add_epi64(_mm_loadu_si128(&at[1]), last));
    }
}

/* Coefficients are taken for 2^31 more, which the sum of the basis times 2^31 takes away again. Both pass 2^64, together they do not. */
static int64_t sum_one(const uint32_t *basis_q20, const int32_t *coefficient, int32_t term_count)
{
    const __m128i more = _mm_set1_epi32(INT32_MIN);
    const __m128i lower = _mm_set_epi32(0, -1, 0, -1);
    __m128i sum = _mm_setzero_si128();
    __m128i plain = sum;
#pragma GCC unroll 4
    for (int32_t i = 0; i < term_count; i += 4) {
        const __m128i basis = _mm_loadu_si128((const __m128i *)&basis_q20[i]);
        const __m128i other =
            _mm_xor_si128(_mm_loadu_si128((const __m128i *)&coefficient[i]), more);
        const __m128i odd = _mm_srli_epi64(basis, 32);
        plain = _mm_add_epi64(plain, _mm_add_epi64(_mm_and_si128(basis, lower), odd));
        sum = _mm_add_epi64(sum, _mm_mul_epu32(basis, other));
        sum = _mm_add_epi64(sum, _mm_mul_epu32(odd, _mm_srli_epi64(other, 32)));
    }
    int64_t part[2];
    _mm_storeu_si128((__m128i *)part, _mm_sub_epi64(sum, _mm_slli_epi64(plain, 31)));
    return part[0] + part[1];
}

static inline __m128i changed(const int64_t *sum, __m128i by, bool is_less)
{
    const __m128i before = _mm_loadu_si128((const __m128i *)sum);
    return is_less ? _mm_sub_epi64(before, by) : _mm_add_epi64(before, by);
}

static inline void add_products(const uint32_t *basis_q20, uint32_t factor, bool is_less,
                                int64_t *sum, int32_t term_count)
{
    const __m128i each = _mm_set1_epi32((int32_t)factor);
#pragma GCC unroll 4
    for (int32_t i = 0; i < term_count; i += 4) {
        const __m128i basis = _mm_loadu_si128((const __m128i *)&basis_q20[i]);
        const __m128i even = _mm_mul_epu32(basis, each);
        const __m128i odd = _mm_mul_epu32(_mm_srli_epi64(basis, 32), each);
        _mm_storeu_si128((__m128i *)&sum[i],
                         changed(&sum[i], _mm_unpacklo_epi64(even, odd), is_less));
        _mm_storeu_si128((__m128i *)&sum[i + 2],
                         changed(&sum[i + 2], _mm_unpackhi_epi64(even, odd), is_less));
    }
}

/* Products without a sign; what a negative factor brings is taken away. */
static void add_one(const uint32_t *basis_q20, int32_t factor, int64_t *sum, int32_t term_count)
{
    if (factor < 0) {
        add_products(basis_q20, (uint32_t)-factor, true, sum, term_count);
    } else {
        add_products(basis_q20, (uint32_t)factor, false, sum, term_count);
    }
}

#else

/* Two centres at a time: sums are loaded and stored half as often. */
void ih_multiquadric_lines(const int32_t *coefficient, const int32_t *const *line_q20,
                           int32_t line_count, int32_t count, int32_t width, int64_t *sum)
{
    for (int32_t x = 0; x < width; x++) {
        sum[x] = 0;
    }
    for (int32_t k = 0; k < line_count; k++) {
        const int32_t *here_q20 = line_q20[k];
        for (int32_t i = 0; i < count; i += 2) {
            const int32_t *next_q20 = &here_q20[width];
            const int32_t first = coefficient[0], second = coefficient[1];
            for (int32_t x = 0; x < width; x++) {
                sum[x] += (int64_t)first * here_q20[x] + (int64_t)second * next_q20[x];
            }
            coefficient = &coefficient[2];
            here_q20 = &next_q20[width];
        }
    }
}

static int64_t sum_one(const uint32_t *basis_q20, const int32_t *coefficient, int32_t term_count)
{
    int64_t sum = 0;
#pragma GCC unroll 4
    for (int32_t i = 0; i < term_count; i++) {
        sum += (int64_t)(int32_t)basis_q20[i] * coefficient[i];
    }
    return sum;
}

static void add_one(const uint32_t *basis_q20, int32_t factor, int64_t *sum, int32_t term_count)
{
#pragma GCC unroll 4
    for (int32_t i = 0; i < term_count; i++) {
        sum[i] += (int64_t)(int32_t)basis_q20[i] * factor;
    }
}

#endif

#ifdef LINE_VECTORS
/* A grid of 47 nodes: all at once. */
void ih_multiquadric_lines(const int32_t *coefficient, const int32_t *const *line_q20,
                           int32_t line_count, int32_t count, int32_t width, int64_t *sum)
{
    int32_t x = 0;
    for (; x + LINE_VECTORS * LINE_LANES <= width; x += LINE_VECTORS * LINE_LANES) {
        sum_lines(coefficient, line_q20, line_count, count, width, LINE_VECTORS, x, sum);
    }
    for (; x < width; x += LINE_LANES) {
        sum_lines(coefficient, line_q20, line_count, count, width, 1, x, sum);
    }
}
#endif

void ih_multiquadric_sum(const uint32_t *basis_q20, int32_t row_count, const int32_t *coefficient,
                         int32_t term_count, int64_t sum[IH_MULTIQUADRIC_ROWS])
{
#ifdef LINE_VECTORS
    if (row_count == IH_MULTIQUADRIC_ROWS) {
        sum_four(basis_q20, coefficient, term_count, sum);
        return;
    }
#endif
    for (int32_t k = 0; k < row_count; k++) {
        sum[k] = sum_one(&basis_q20[k * term_count], coefficient, term_count);
    }
}

void ih_multiquadric_add(const uint32_t *basis_q20, int32_t row_count,
                         const int32_t factor[IH_MULTIQUADRIC_ROWS], int64_t *sum,
                         int32_t term_count)
{
#ifdef LINE_VECTORS
    if (row_count == IH_MULTIQUADRIC_ROWS) {
        add_four(basis_q20, factor, sum, term_count);
        return;
    }
#endif
    for (int32_t k = 0; k < row_count; k++) {
        add_one(&basis_q20[k * term_count], factor[k], sum, term_count);
    }
}
