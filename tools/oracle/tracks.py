"""Float64 reference of the tracks: constant-velocity Kalman filters in matrix form, and the rules
of ih_tracks.h for who gets which detection, what is predicted, what ends and which head is the one.

Sequences are drawn anew until no decision in them is a matter of rounding.
"""

import dataclasses

import numpy as np

import emit
from rig import from_q, to_q

TRACKS_MAX = 8
NONE = -1
SEMI_MM = np.array([78.0, 113, 98])
START_SPEED = 300.0
POSITION_MAX, SPEED_MAX = 500.0, 3000.0
LOGIT_MAX, GATE_LOGIT, CHOICE_LOGIT = 6.0, 4.0, 3.0
# Below these log-odds a detection's variance is so many times as large.
UNSURE_FACTORS = ((2.0, 4.0), (1.0, 25.0), (0.0, 49.0))
FAST_LOGIT = 2.0
AXES_FRACTION = 0.25
SLOW_S = 0.1
VIEW_RAYS_MIN = 4
# Heads of one person: measured ones, which another one has no room between; and one that is expected behind another.
OWN_MM, HIDDEN_MM = np.array([150.0, 150, 250]), np.array([150.0, 150, 450])
BODY_MM = ((-150, 150), (200, 400), (-350, 150))


class Params:
    """What the test sets, whatever ih_tracks_params_default says."""

    gate_mm, gate_mm_per_s = 90, 300
    start, start_head, accept, drop, keep = -1.0, 1.0, 0.5, -0.5, -3.0
    mature_detections = 3
    moved_mm, moved = 25, 1.0  # all detections have more open than closed above them
    memory = 0.75
    through_percent, front_percent = 50, 30
    carry_s, gap_s = 1.0, 2.0
    measured_mm, acceleration = 12, 2500
    switch_frames = 3


class Unclear(Exception):
    """A decision that rounding could reverse."""


def clear(difference, margin):
    """Is it positive, and would it be after rounding?"""
    if abs(difference) < margin:
        raise Unclear
    return difference > 0


@dataclasses.dataclass
class Detection:
    position: np.ndarray
    logit: float
    semi: np.ndarray
    track: int = 0


@dataclasses.dataclass
class Track:
    id: int
    state: np.ndarray  # position and velocity (2 x 3)
    covariance: np.ndarray  # 2 x 2, the same along each axis
    semi: np.ndarray
    logit: float
    seen_s: float
    is_head: bool
    detection: object = None
    detections: int = 1
    start_mm: np.ndarray = None
    has_moved: bool = False

    def predict(self, dt):
        move = np.array([[1, dt], [0, 1]])
        push = Params.acceleration * np.array([[dt * dt / 2], [dt]])
        self.state = move @ self.state
        self.covariance = move @ self.covariance @ move.T + push @ push.T
        # Limited variances keep the correlation of position and speed.
        for at, limit in ((0, POSITION_MAX**2), (1, SPEED_MAX**2)):
            fraction = min(1, limit / self.covariance[at, at])
            self.covariance[at, at] *= fraction
            self.covariance[0, 1] *= fraction
            self.covariance[1, 0] *= fraction

    def correct(self, detection):
        noise = Params.measured_mm**2 * max([1.0] + [factor for limit, factor in UNSURE_FACTORS
                                                     if not clear(detection.logit - limit, 0.002)])
        see = np.array([[1.0, 0.0]])
        gain = self.covariance @ see.T / (see @ self.covariance @ see.T + noise)
        self.state = self.state + gain @ (detection.position[None] - see @ self.state)
        self.state[1] = np.clip(self.state[1], -SPEED_MAX, SPEED_MAX)
        self.covariance = (np.eye(2) - gain @ see) @ self.covariance
        self.semi = self.semi + AXES_FRACTION * (detection.semi - self.semi)

    def judge(self):
        limit = Params.start_head if self.detections < Params.mature_detections else Params.accept
        limit = (Params.drop if self.is_head else limit) - (Params.moved if self.has_moved else 0)
        self.is_head = clear(self.logit - limit, 0.004)

    def remember(self, logit):
        limited = np.clip(logit, -LOGIT_MAX, LOGIT_MAX)
        self.logit = Params.memory * self.logit + (1 - Params.memory) * limited
        self.judge()


def is_body(detection, detections):
    """Is there something above that may be the head to this body?"""
    for other in detections:
        off = detection.position - other.position
        if clear(other.logit - Params.start, 0.002) and all(
                [clear(min(off[i] - low, high - off[i]), 0.01) for i, (low, high) in enumerate(BODY_MM)]):
            return True
    return False


class Tracks:
    def __init__(self):
        self.time_s, self.last_id, self.tracks = None, 0, []
        self.selected, self.rival, self.rival_frames = 0, 0, 0

    def expect(self, time_s):
        step = 0 if self.time_s is None else time_s - self.time_s
        if self.time_s is None or step < 0 or step > Params.gap_s:
            self.tracks, self.selected, self.rival_frames, step = [], 0, 0, 0
        self.time_s = time_s
        for track in self.tracks:
            track.predict(step)
            track.detection = None
        return self.tracks

    def merit(self, track, detection, gone):
        gate = Params.gate_mm + Params.gate_mm_per_s * (self.time_s - track.seen_s)
        away = np.linalg.norm(track.state[0] - detection.position)
        if not clear(detection.logit - Params.keep, 0.002):
            return None
        if gone and not clear(detection.logit - Params.accept, 0.002):
            return None
        if clear(away - gate, 0.5):
            if (not track.is_head or not clear(detection.logit - Params.accept, 0.002)
                    or not self.is_own(track, detection.position, HIDDEN_MM)):
                return None
            apart = np.linalg.norm((track.state[0] - detection.position) / HIDDEN_MM)
            return detection.logit - FAST_LOGIT - GATE_LOGIT * apart**2
        return detection.logit - GATE_LOGIT * (away / gate)**2

    def associate(self, detections, gone):
        """The best pair first."""
        while True:
            pairs = [(self.merit(t, f, g), t, f) for t, g in zip(self.tracks, gone)
                     if t.detection is None for f in detections
                     if f.track == 0 and not is_body(f, detections)]
            pairs = sorted([p for p in pairs if p[0] is not None], key=lambda p: -p[0])
            if not pairs:
                return
            if len(pairs) > 1:
                clear(pairs[0][0] - pairs[1][0], 0.02)
            _, track, detection = pairs[0]
            self.give(track, detection)

    @staticmethod
    def is_own(track, position, limit_mm=OWN_MM):
        away = np.linalg.norm((track.state[0] - position) / limit_mm)
        return clear(1 - away, 0.02)

    def give(self, track, detection):
        track.detection, detection.track, track.seen_s = detection, track.id, self.time_s
        track.detections += 1
        track.correct(detection)
        if not track.has_moved:
            away = np.linalg.norm(track.state[0] - track.start_mm)
            track.has_moved = clear(away - Params.moved_mm, 0.05)
        track.remember(detection.logit)

    def prune(self, gone, hidden):
        kept = []
        for track, is_gone, is_hidden in zip(self.tracks, gone, hidden):
            unseen = self.time_s - track.seen_s
            if track.detection is None and not is_hidden:
                track.remember(Params.keep)
            if track.detection is not None:
                ended = not clear(track.logit - Params.keep, 0.004)
            else:
                ended = (not track.is_head or clear(unseen - Params.carry_s, 1e-9) or is_gone
                         or any([self.is_own(track, t.state[0], HIDDEN_MM) for t in self.tracks
                                 if t.detection is not None and t.is_head]))
            near = [self.is_own(track, t.state[0]) for t in kept]
            if ended or any(near):
                if track.detection is not None:
                    track.detection.track = 0
                continue
            if track.detection is None:
                track.state[1] *= 1 - min(unseen, SLOW_S) / SLOW_S
            kept.append(track)
        self.tracks = kept

    def start(self, detections):
        for detection in detections:
            if len(self.tracks) == TRACKS_MAX:
                return
            if (detection.track != 0 or not clear(detection.logit - Params.start, 0.002)
                    or is_body(detection, detections)):
                continue
            if any([self.is_own(t, detection.position) for t in self.tracks]):
                continue
            self.last_id += 1
            detection.track = self.last_id
            track = Track(self.last_id, np.array([detection.position, np.zeros(3)]),
                          np.diag([Params.measured_mm**2, START_SPEED**2]).astype(float),
                          detection.semi.copy(), np.clip(detection.logit, -LOGIT_MAX, LOGIT_MAX),
                          self.time_s, False, detection, start_mm=detection.position)
            track.judge()
            self.tracks.append(track)

    def select(self):
        """The nearest head, but for doubtful ones."""
        heads = sorted([t for t in self.tracks if t.is_head], key=lambda t: -t.logit)
        good = [t for t in heads
                if not clear(min(heads[0].logit - CHOICE_LOGIT, Params.accept) - t.logit, 0.004)]
        near = sorted([(t.detection is None, np.linalg.norm(self.shown(t)), t.id) for t in good])
        if len(near) > 1 and near[0][0] == near[1][0]:
            clear(near[0][1] - near[1][1], 0.1)
        wanted = near[0][2] if near else 0
        if self.selected in [t.id for t in heads] and wanted != self.selected:
            self.rival_frames = self.rival_frames + 1 if wanted == self.rival else 1
            self.rival = wanted
            if self.rival_frames < Params.switch_frames:
                wanted = self.selected
        else:
            self.rival, self.rival_frames = 0, 0
        self.selected = wanted

    @staticmethod
    def shown(track):
        return track.state[0] if track.detection is None else track.detection.position

    def update(self, detections, views):
        gone, hidden = [], []
        for through, hit, front in views:
            rays = through + hit + front
            hidden.append(100 * front >= Params.front_percent * rays)
            gone.append(rays < VIEW_RAYS_MIN or
                        100 * through > Params.through_percent * rays and not hidden[-1])
        self.associate(detections, gone)
        self.prune(gone, hidden)
        self.start(detections)
        self.select()


def detection(random, position, logit, noise=6.0):
    """As the firmware gets it: rounded."""
    position = np.asarray(position, float) + random.normal(0, noise, 3)
    semi = SEMI_MM * np.exp(random.normal(0, 0.04, 3))
    return Detection(from_q(to_q(position, 8), 8), float(from_q(to_q(logit, 10), 10)),
                   from_q(to_q(semi, 8), 8))


HIT, THROUGH, FRONT, NOTHING = (1, 14, 0), (16, 1, 1), (2, 3, 12), (0, 0, 0)


def walk(random):
    """Along, at 0.5 m/s, and back."""
    for k in range(60):
        x = -150 + 20 * min(k, 60 - k) / 2
        yield 40000, [detection(random, (x, -40, 800), random.normal(3, 1))], HIT


def crossing(random):
    """Two heads that change sides 300 mm apart in depth."""
    for k in range(50):
        x = -250 + 10 * k
        two = [detection(random, (x, -40, 700), random.normal(4, 0.7)),
               detection(random, (-x, -20, 1000), random.normal(2.5, 0.7))]
        yield 40000, two[::1 if random.integers(2) else -1], HIT


def hands(random):
    """Hands before a moving head in frames 10 to 17; then it leaves, and the seat is seen."""
    for k in range(34):
        position = (4 * k, -60, 750)
        seen = k < 10 or 18 <= k < 28
        view = HIT if seen else FRONT if k < 18 else THROUGH
        yield 40000, [detection(random, position, random.normal(3, 0.5))] if seen else [], view


def rush(random):
    """Somebody comes at 2.6 m/s, stops, and goes aside; another head stays where it is."""
    for k in range(40):
        z = 1800 - (0 if k < 8 else min(100 * (k - 7), 1000))
        position = (60 * max(k - 28, 0), -40, z)
        both = [detection(random, position, random.normal(4, 0.5)),
                detection(random, (-420, 0, 1200), random.normal(3, 0.5))]
        yield 40000, both, FRONT


def weak(random):
    """A detection that is never convincing, then one that is; then rejected ones inside the gate."""
    for k in range(40):
        logit = -0.4 if k < 6 else 3 if k < 20 else -1.7 if k < 26 else 2
        yield 40000, [detection(random, (30, 0, 900 + 3 * k), random.normal(logit, 0.15))], HIT


def stroll(random):
    """A doubtful detection that stands, goes 200 mm aside, becomes ever less of a head, and stands again."""
    for k in range(90):
        x = 4 * min(max(k - 15, 0), 50)
        yield 40000, [detection(random, (x, -40, 900), random.normal(0.1 if k < 60 else -1 if k < 75 else -2.2, 0.05))], HIT


def crowd(random):
    """Six that come and go, frames late, lost and far apart."""
    positions = [np.array([x, y, z], float) for x, y, z in
              [(-420, 0, 900), (-210, -50, 800), (0, 10, 700), (200, 0, 1000), (410, -30, 1200),
               (30, -200, 1300)]]
    speeds = random.normal(0, 150, (6, 3))
    for _ in range(60):
        step = int(random.choice([0, 20000, 40000, 40000, 40000, 90000, 400000, 1500000, 2500000,
                                  -5000], p=[.03, .1, .25, .25, .18, .1, .04, .02, .02, .01]))
        there = []
        for index, position in enumerate(positions):
            speeds[index] -= step / 1e6 * 1.5 * (position - [0, 0, 900]) * (np.abs(position - [
                0, 0, 900]) > 450)
            position += speeds[index] * max(step, 0) / 1e6
            if random.uniform() < 0.8:
                there.append(detection(random, position, random.normal(2 - 0.4 * index, 1), 4))
        there.sort(key=lambda f: -f.logit)
        yield step, there, [HIT, FRONT, NOTHING, HIT][random.integers(4)]


def chest(random):
    """A chest below a head, more probable than it and nearer; then the head is not seen."""
    for k in range(30):
        both = [detection(random, (3 * k, 260, 760), random.normal(3, 0.5)),
                detection(random, (3 * k, -20, 850), random.normal(1.5, 0.5))]
        yield 40000, both if k < 20 else both[:1], FRONT


def slow(random):
    """A frame each 0.7 to 1.9 s: limited variances."""
    for k in range(30):
        yield int(random.uniform(0.7e6, 1.9e6)), [detection(random, (20 * (k % 5), 0, 800), 3)], HIT


SCENES = {"walk": walk, "crossing": crossing, "hands": hands, "rush": rush, "weak": weak, "stroll": stroll,
          "crowd": crowd, "chest": chest, "slow": slow}


def play(scene, seed):
    """Frames (time, detections, views) and what the tracks are after each."""
    random = np.random.default_rng(seed)
    tracks, time_us, frames = Tracks(), 1000000, []
    for step_us, detections, view in SCENES[scene](random):
        time_us += step_us
        tracks.expect(time_us / 1e6)
        views = [view] * len(tracks.tracks)
        tracks.update(detections, views)
        after = [(t.id, t.is_head, t.detection is not None, *t.state[0], *t.state[1],
                  *t.semi, t.covariance[0, 0], t.covariance[0, 1], t.covariance[1, 1], t.logit)
                 for t in tracks.tracks]
        frames.append((time_us, detections, view, after, tracks.selected))
    return frames


def write_vectors(directory):
    inc = emit.Inc("Sequences of detections, and the tracks after every frame.")
    rows = []
    for scene in SCENES:
        seed = 1
        while True:
            try:
                frames = play(scene, seed)
                break
            except Unclear:
                seed += 1
        founds, states, lines = [], [], []
        for time_us, detections, view, after, selected in frames:
            lines.append("%d, %d, %d, {%d, %d, %d}, %d" % (
                time_us, len(detections), len(after), *view, selected))
            founds += ["{{%d, %d, %d}, {%d, %d, %d}, %d, %d}" % (
                *to_q(f.position, 8), *to_q(f.semi, 8), to_q(f.logit, 10), f.track)
                       for f in detections]
            states += ["{%s, %s, %s, {%s, %s, %s}, {%s, %s, %s}, {%s, %s, %s}, %s, %s, %s, %s}" % (
                *map(int, s[:3]), *emit.numbers(s[3:], 3)) for s in after]
        inc.raw("\nstatic const struct vector_found vector_%s_founds[] = {\n%s};\n" % (
            scene, emit.wrap(founds)))
        inc.raw("\nstatic const struct vector_state vector_%s_states[] = {\n%s};\n" % (
            scene, emit.wrap(states)))
        inc.struct_array("vector_frame", "vector_%s_frames" % scene, lines)
        rows.append('"%s", %d, vector_%s_frames, vector_%s_founds, vector_%s_states' % (
            scene, len(frames), scene, scene, scene))
    inc.struct_array("vector_sequence", "vector_sequences", rows)
    return inc.write(directory, "tracks.inc")
