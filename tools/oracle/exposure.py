"""Float64 reference of the exposure rule."""

import numpy as np

import emit

UNIT = 81
LABELLED_MIN = 24
RETRY = 256
STEP_MIN, STEP_MAX = 205 / 256, 320 / 256
DEFAULTS = dict(exposure=(100, 20000), duty=(16, 256), weak_grey=12, strong_grey=96, lost_max=6)


def damped(wanted, is_now):
    """Half of the change, within the limits of a step."""
    return float(np.clip(1 + (min(wanted / max(is_now, 1), 4) - 1) / 2, STEP_MIN, STEP_MAX))


def proposed(state, look, exposure, duty, weak_grey, strong_grey, lost_max):
    """state: exposure, duty, ceiling, frames it holds; look: labelled, weak, strong, lost."""
    now, fraction, ceiling, frames = state
    labelled, weak, strong, lost = look
    weak_aim, strong_aim = weak_grey * UNIT, strong_grey * UNIT
    frames = max(frames - 1, 0)
    ceiling = ceiling if frames else exposure[1]
    few = labelled < LABELLED_MIN
    factor, more_exposure = 1.0, True
    if lost > lost_max and (few or fraction < duty[1] or 2 * weak >= weak_aim):
        now = float(np.clip(now * STEP_MIN, *exposure))
        return now, float(np.clip(fraction * STEP_MAX, *duty)), now, RETRY
    if few:
        factor = STEP_MAX
    elif 8 * weak < 7 * weak_aim and 8 * strong < 7 * strong_aim:
        factor, more_exposure = damped(weak_aim, weak), 2 * lost <= lost_max
    elif 8 * strong > 9 * strong_aim and 8 * weak > 9 * weak_aim:
        factor = damped(strong_aim, strong)
    if factor > 1 and fraction < duty[1]:
        fraction = max(min(fraction + 1, duty[1]), float(np.clip(fraction * factor, *duty)))
    elif factor > 1 and more_exposure:
        now = max(now, min(float(np.clip(now * factor, *exposure)), ceiling))
    elif factor < 1 and fraction > duty[0]:
        fraction = float(np.clip(fraction * factor, *duty))
    elif factor < 1:
        now = float(np.clip(now * factor, *exposure))
    return now, fraction, ceiling, frames


def write_vectors(directory):
    inc = emit.Inc("States and looks, and the exposure and duty after them.")
    random = np.random.default_rng(46)
    rows = []
    for _ in range(300):
        now = int(np.exp(random.uniform(np.log(100), np.log(20000))))
        fraction = int(random.choice([16, 17, 255, 256, random.integers(16, 257)]))
        frames = int(random.choice([0, 1, 2, 100]))
        ceiling = int(now * random.uniform(1, 1.4)) if frames else 20000
        labelled = int(random.choice([0, 23, 24, random.integers(24, 362)]))
        weak = int(random.integers(100, 2500)) if labelled >= LABELLED_MIN else 0
        strong = int(weak + random.integers(0, 9500)) if weak else 0
        lost = int(random.choice([0, 3, 4, 6, 7, 40]))
        state, look = (now, fraction, ceiling, frames), (labelled, weak, strong, lost)
        after = proposed(state, look, **DEFAULTS)
        rows.append("{%s}, {%s}, %s, %s, %s, %d" % (
            ", ".join(map(str, state)), ", ".join(map(str, look)),
            *(emit.number(x, 4) for x in after[:3]), after[3]))
    inc.struct_array("vector_step", "vector_steps", rows)
    return inc.write(directory, "exposure.inc")
