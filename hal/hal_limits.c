#include "hal_limits.h"

#define PERCENT 100
/* 30,000 years. */
#define TIME_MAX_US (INT64_MAX / 8)

static int64_t credit_max(const struct hal_limits *limits)
{
    return limits->config.duty_percent * (int64_t)HAL_LIMITS_BURST_US +
           PERCENT * (int64_t)HAL_LIMITS_SLACK_US;
}

void hal_limits_init(struct hal_limits *limits, const struct hal_limits_config *config,
                     int64_t now_us)
{
    *limits = (struct hal_limits){.config = *config, .look_us = now_us};
    limits->credit = credit_max(limits);
}

static void use_duty(struct hal_limits *limits, int64_t passed_us, int64_t on_us)
{
    int64_t max = credit_max(limits);
    limits->credit += passed_us * limits->config.duty_percent - on_us * PERCENT;
    limits->credit = limits->credit < max ? limits->credit : max;
    if (limits->credit < 0) {
        limits->duty_is_used_up = true;
    } else if (limits->credit >= max / 2) {
        limits->duty_is_used_up = false;
    }
}

/* A sum of times since the machine was started. */
static bool is_time(int64_t time_us)
{
    return time_us >= 0 && time_us <= TIME_MAX_US;
}

bool hal_limits_allow(struct hal_limits *limits, int64_t now_us, int64_t on_us,
                      int64_t judged_on_us)
{
    int64_t passed_us = now_us > limits->look_us ? now_us - limits->look_us : 0;
    bool can_be = is_time(on_us) && is_time(limits->on_us) && on_us >= limits->on_us &&
                  on_us - limits->on_us <= passed_us;
    bool is_new = judged_on_us != limits->judged_on_us;
    int64_t high_us = can_be ? on_us - limits->on_us : passed_us;
    limits->look_us = now_us;
    limits->on_us = is_time(on_us) ? on_us : -1;
    limits->judged_on_us = judged_on_us;
    limits->low_us = high_us == 0 ? limits->low_us + passed_us : 0;
    limits->silent_us += high_us;
    if (limits->low_us >= HAL_LIMITS_PAUSE_US) {
        limits->silent_us = 0;
    } else if (can_be && is_new && is_time(judged_on_us) && judged_on_us <= on_us &&
               on_us - judged_on_us < limits->silent_us) {
        limits->silent_us = on_us - judged_on_us;
    }
    use_duty(limits, passed_us, high_us);
    return limits->silent_us <= limits->config.cap_us + HAL_LIMITS_SLACK_US &&
           !limits->duty_is_used_up;
}
