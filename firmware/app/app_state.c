#include "app_state.h"

#include <inttypes.h>

int64_t app_state_now_us(const struct app_state *state)
{
    return state->hal.clock->now_us(state->hal.clock->context);
}

void app_state_end(struct app_state *state, enum app_exit exit)
{
    app_laser_wish(&state->laser, false, app_state_now_us(state));
    state->is_over = true;
    state->exit = exit;
    if (state->config->check && exit == APP_EXIT_GOOD &&
        state->health.frame_count < APP_HEALTH_CHECKED) {
        app_log_say(state->log, APP_LOG_ERROR,
                    "%s: cannot be determined: ended after %" PRId32 " of %d lit frames",
                    state->config->rig, state->health.frame_count, APP_HEALTH_CHECKED);
        state->exit = APP_EXIT_FAILED;
    }
}
