#include "app_state.h"

int64_t app_state_now_us(const struct app_state *state)
{
    return state->hal.clock->now_us(state->hal.clock->context);
}

void app_state_end(struct app_state *state, enum app_exit exit)
{
    app_laser_wish(&state->laser, false, app_state_now_us(state));
    state->is_over = true;
    state->exit = exit;
}
