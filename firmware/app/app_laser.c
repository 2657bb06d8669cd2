#include "app_laser.h"

#define PERCENT 100

static int64_t min(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static int64_t credit_max(const struct app_laser *laser)
{
    return (int64_t)laser->config.duty_percent * APP_LASER_BURST_US;
}

static void block(struct app_laser *laser, enum app_laser_block why, bool blocked)
{
    if (blocked) {
        laser->blocks |= (unsigned)why;
    } else {
        laser->blocks &= ~(unsigned)why;
    }
}

/* The time since the last call goes into the sums. */
static void account(struct app_laser *laser, int64_t now_us)
{
    int64_t passed_us = now_us - laser->tick_us;
    int32_t duty = laser->config.duty_percent;
    laser->tick_us = now_us;
    laser->off_us = laser->is_on ? 0 : laser->off_us + passed_us;
    if (laser->is_on) {
        laser->on_us += passed_us;
        laser->silent_us += passed_us;
        laser->credit -= passed_us * (PERCENT - duty);
    } else {
        laser->credit += passed_us * duty;
    }
    if (laser->credit <= 0) {
        block(laser, APP_LASER_BLOCK_DUTY, true);
    } else if (laser->credit >= credit_max(laser)) {
        laser->credit = credit_max(laser);
        block(laser, APP_LASER_BLOCK_DUTY, false);
    }
}

/* Off, whatever it takes. False: only giving the lines back may have done it. */
static bool force_off(struct app_laser *laser, struct hal_error *error)
{
    bool off = false;
    for (int i = 0; i < APP_LASER_OFF_TRIES && !off; i++) {
        off = laser->strobe->set(laser->strobe->context, false, error);
    }
    laser->strobe->close(laser->strobe->context);
    laser->is_open = false;
    laser->is_on = false;
    laser->may_be_on = laser->may_be_on || !off;
    return off;
}

/* The error that brought us here is kept, not the ones that follow. */
static void fail(struct app_laser *laser)
{
    struct hal_error ignored;
    block(laser, APP_LASER_BLOCK_FAULT, true);
    force_off(laser, &ignored);
}

static void switch_off(struct app_laser *laser)
{
    laser->is_on = false;
    if (!laser->strobe->set(laser->strobe->context, false, &laser->failed)) {
        fail(laser);
    }
}

/* False: it could not be read, and everything is off. */
static bool read_interlock(struct app_laser *laser)
{
    bool closed = false;
    if (!laser->strobe->interlock(laser->strobe->context, &closed, &laser->failed)) {
        fail(laser);
        return false;
    }
    if (!closed) {
        laser->open_us = laser->tick_us;
        block(laser, APP_LASER_BLOCK_INTERLOCK, true);
    } else if (laser->tick_us - laser->open_us >= APP_LASER_CLOSED_US) {
        block(laser, APP_LASER_BLOCK_INTERLOCK, false);
    }
    return true;
}

/* An edge for the one-shot. False: it failed, and everything is off. */
static bool beat(struct app_laser *laser)
{
    laser->beat_us = laser->tick_us;
    if (!laser->strobe->beat(laser->strobe->context, &laser->failed)) {
        fail(laser);
        return false;
    }
    return true;
}

static void switch_on(struct app_laser *laser)
{
    if (!read_interlock(laser) || laser->blocks != 0) {
        return;
    }
    /* Two edges, so that one of them rises: a one-shot that has run out lets light through at once. */
    for (int edge = 0; edge < 2; edge++) {
        if (!beat(laser)) {
            return;
        }
    }
    laser->is_on = true;
    laser->on_count++;
    if (!laser->strobe->set(laser->strobe->context, true, &laser->failed)) {
        fail(laser);
        return;
    }
    if (read_interlock(laser) && laser->blocks != 0) {
        switch_off(laser);
    }
}

/* Even if the guard has to end it. */
static bool duty_lasts(const struct app_laser *laser)
{
    int64_t longest_us = laser->config.cap_us + HAL_LIMITS_SLACK_US;
    return laser->credit >= longest_us * (PERCENT - laser->config.duty_percent);
}

/* Until this stage ends, as far as it is known. */
static bool cap_lasts(const struct app_laser *laser)
{
    int64_t end_us = laser->stage_us + laser->stage_max_us[laser->stage];
    return end_us - laser->tick_us <= laser->config.cap_us - laser->silent_us;
}

/* The line as wish and blocks say. */
static void apply(struct app_laser *laser)
{
    if (!laser->is_open) {
        return;
    }
    bool lasts = laser->stage == APP_LASER_IDLE || (duty_lasts(laser) && cap_lasts(laser));
    bool on = laser->wished && laser->blocks == 0 && lasts;
    if (on && !laser->is_on) {
        switch_on(laser);
    } else if (!on && laser->is_on) {
        switch_off(laser);
    }
}

/* How long until the duty changes something. */
static int64_t duty_wait_us(const struct app_laser *laser)
{
    int32_t duty = laser->config.duty_percent;
    if (laser->is_on && duty < PERCENT) {
        return laser->credit / (PERCENT - duty) + 1;
    }
    if ((laser->blocks & APP_LASER_BLOCK_DUTY) != 0) {
        return (credit_max(laser) - laser->credit) / duty + 1;
    }
    return APP_LASER_NEVER_US;
}

void app_laser_init(struct app_laser *laser, const struct app_laser_config *config,
                    const struct hal_strobe *strobe, int64_t now_us)
{
    *laser = (struct app_laser){
        .config = *config,
        .strobe = strobe,
        .blocks = APP_LASER_BLOCK_RIG | APP_LASER_BLOCK_CAMERA,
        .tick_us = now_us,
        .beat_us = now_us,
        .open_us = now_us - APP_LASER_CLOSED_US,
    };
    if (!config->enabled) {
        laser->blocks |= APP_LASER_BLOCK_DISABLED;
    }
    laser->credit = credit_max(laser);
}

bool app_laser_open(struct app_laser *laser, struct hal_error *unproven)
{
    unproven->text[0] = 0;
    if (!laser->config.enabled) {
        return true;
    }
    if (!laser->strobe->open(laser->strobe->context, &laser->failed)) {
        block(laser, APP_LASER_BLOCK_FAULT, true);
        return false;
    }
    laser->is_open = true;
    if (!laser->strobe->prove(laser->strobe->context, unproven, &laser->failed)) {
        fail(laser);
        return false;
    }
    return true;
}

void app_laser_close(struct app_laser *laser, int64_t now_us)
{
    account(laser, now_us);
    laser->wished = false;
    if (laser->is_open && !force_off(laser, &laser->failed)) {
        block(laser, APP_LASER_BLOCK_FAULT, true);
    }
}

void app_laser_wish(struct app_laser *laser, bool on, int64_t now_us)
{
    account(laser, now_us);
    laser->wished = on;
    apply(laser);
}

void app_laser_rig(struct app_laser *laser, bool is_valid, int64_t now_us)
{
    account(laser, now_us);
    block(laser, APP_LASER_BLOCK_RIG, !is_valid);
    apply(laser);
}

void app_laser_camera(struct app_laser *laser, bool streams, int64_t frame_time_us, int64_t now_us)
{
    account(laser, now_us);
    if (streams) {
        int64_t silent_us = APP_LASER_SILENT_FRAMES * frame_time_us;
        laser->silent_max_us = min(silent_us, laser->config.cap_us);
        if (laser->off_us >= HAL_LIMITS_PAUSE_US) {
            laser->silent_us = 0;
        }
        block(laser, APP_LASER_BLOCK_SILENCE, laser->silent_us >= laser->silent_max_us);
    }
    block(laser, APP_LASER_BLOCK_CAMERA, !streams);
    apply(laser);
}

static void begin_stage(struct app_laser *laser, enum app_laser_stage stage)
{
    int64_t took_us = laser->tick_us - laser->stage_us;
    if (took_us > laser->stage_max_us[laser->stage]) {
        laser->stage_max_us[laser->stage] = took_us;
    }
    laser->stage = stage;
    laser->stage_us = laser->tick_us;
}

/* Nothing is switched on here: the loop says first what this frame means for the next one. */
void app_laser_frame(struct app_laser *laser, int64_t now_us)
{
    account(laser, now_us);
    laser->silent_us = 0;
    block(laser, APP_LASER_BLOCK_SILENCE, false);
    if (laser->is_open && !laser->strobe->judged(laser->strobe->context, &laser->failed)) {
        fail(laser);
        return;
    }
    if (laser->stage != APP_LASER_IDLE) {
        begin_stage(laser, APP_LASER_FINDS);
    }
    if (laser->is_on) {
        apply(laser);
    }
}

void app_laser_busy(struct app_laser *laser, bool busy, int64_t now_us)
{
    account(laser, now_us);
    begin_stage(laser, busy ? APP_LASER_JUDGES : APP_LASER_IDLE);
    if (busy) {
        if (laser->is_on && !duty_lasts(laser)) {
            block(laser, APP_LASER_BLOCK_DUTY, true);
        }
        apply(laser);
    }
}

void app_laser_interlock(struct app_laser *laser, int64_t now_us)
{
    account(laser, now_us);
    if (laser->is_open && read_interlock(laser)) {
        apply(laser);
    }
}

static int64_t interlock_wait_us(const struct app_laser *laser)
{
    return (laser->blocks & APP_LASER_BLOCK_INTERLOCK) != 0 ? APP_LASER_CLOSED_US
                                                            : APP_LASER_NEVER_US;
}

static int64_t silence_wait_us(const struct app_laser *laser)
{
    return laser->is_on ? laser->silent_max_us - laser->silent_us : APP_LASER_NEVER_US;
}

static int64_t beat_wait_us(const struct app_laser *laser, int64_t now_us)
{
    return laser->is_on ? laser->beat_us + APP_LASER_BEAT_US - now_us : APP_LASER_NEVER_US;
}

int64_t app_laser_tick(struct app_laser *laser, int64_t now_us)
{
    account(laser, now_us);
    if (laser->is_open) {
        read_interlock(laser); /* should its event have been lost */
    }
    if (laser->silent_us >= laser->silent_max_us && (laser->blocks & APP_LASER_BLOCK_CAMERA) == 0) {
        block(laser, APP_LASER_BLOCK_SILENCE, true);
    }
    apply(laser);
    if (laser->is_on && now_us - laser->beat_us >= APP_LASER_BEAT_US) {
        beat(laser);
    }
    /* Only now: what was switched on just now has limits too. */
    int64_t wait_us = min(duty_wait_us(laser), silence_wait_us(laser));
    wait_us = min(wait_us, interlock_wait_us(laser));
    return min(wait_us, beat_wait_us(laser, now_us));
}

const char *app_laser_block_text(unsigned blocks)
{
    static const struct {
        enum app_laser_block block;
        const char *text;
    } texts[] = {
        {APP_LASER_BLOCK_DISABLED, "not enabled"},
        {APP_LASER_BLOCK_INTERLOCK, "the interlock is open, or a guard keeps the laser off"},
        {APP_LASER_BLOCK_RIG, "no valid rig"},
        {APP_LASER_BLOCK_CAMERA, "no camera"},
        {APP_LASER_BLOCK_SILENCE, "no frames come"},
        {APP_LASER_BLOCK_DUTY, "the duty limit is reached"},
    };
    for (unsigned i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        if ((blocks & texts[i].block) != 0) {
            return texts[i].text;
        }
    }
    return NULL;
}
