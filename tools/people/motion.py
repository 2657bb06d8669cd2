"""How people move: angles over time, ten frames a second."""

import numpy

FRAME_US = 100000
# middle reach, low and high reach in degrees of each angle, as tools/render/rd_motion.c
SWAYS = {"lean": (1.0, 2.0, 7.0), "bend": (2.0, 2.0, 8.0), "twist": (3.0, 3.0, 12.0), "yaw": (8.0, 12.0, 50.0),
         "pitch": (5.0, 4.0, 16.0), "roll": (2.0, 3.0, 10.0)}
CALM = {"yaw": (12.0, 4.0, 20.0), "pitch": (6.0, 2.0, 8.0), "roll": (3.0, 1.0, 4.0)}
LEANING = {"lean": (10.0, 8.0, 22.0), "bend": (12.0, 8.0, 24.0), "pitch": (8.0, 5.0, 18.0), "roll": (4.0, 4.0, 12.0)}


def smoothstep(low, high, x):
    t = numpy.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


class Sways:
    """Slow irregular swinging of every angle."""

    def __init__(self, rng, *overrides):
        table = dict(SWAYS)
        for override in overrides:
            table.update(override)
        self.parts = {}
        for name in sorted(table):
            middle, low, high = table[name]
            reach = rng.uniform(low, high)
            middle = rng.uniform(-middle, middle)
            periods = rng.uniform(24.0, 60.0), rng.uniform(9.0, 20.0)
            self.parts[name] = (middle, 0.75 * reach, 0.25 * reach, *periods, *rng.uniform(0.0, 2.0 * numpy.pi, 2))

    def at(self, frame):
        angles = {}
        for name, (middle, reach1, reach2, period1, period2, phase1, phase2) in self.parts.items():
            degrees = (middle + reach1 * numpy.sin(2.0 * numpy.pi * frame / period1 + phase1) +
                       reach2 * numpy.sin(2.0 * numpy.pi * frame / period2 + phase2))
            angles[name] = numpy.radians(degrees)
        return angles


class Spin:
    """Right round, unevenly: feet push the floor."""

    def __init__(self, rng, frames):
        self.start = rng.uniform(-0.6, 0.6) + (rng.uniform(0.0, 6.0) if rng.random() < 0.3 else 0.0)
        self.total = rng.choice([-1.0, 1.0]) * 2.0 * numpy.pi * min(1.0, frames / 24.0)
        self.frames = frames

    def at(self, frame):
        part = frame / max(1, self.frames - 1)
        part += 0.04 * numpy.sin(6.0 * numpy.pi * part)
        return self.start + self.total * part


class Visit:
    """Comes in from a side or from afar, stays, and goes; or walks past. Walks 1.0 to 1.6 m/s."""

    def __init__(self, rng, frames, head_mm, kind):
        speed = rng.uniform(100.0, 160.0)
        self.outside_mm = 0.5 * head_mm[2] + 450.0
        self.past = kind == "past"
        self.side_in, self.side_out = rng.choice([-1.0, 1.0], 2)
        self.deep_mm = rng.uniform(-150.0, 350.0)
        self.stand_mm = rng.uniform(0.0, 250.0)
        self.walk = self.outside_mm / speed
        self.come = rng.uniform(-2.0, 4.0)
        self.leave = self.come + self.walk + max(3.0, frames - 2.0 * self.walk - 4.0 + rng.uniform(-3.0, 1.0))
        self.ahead = not self.past and rng.random() < 0.2
        self.phase = rng.uniform(0.0, 6.28)

    def deepest_mm(self):
        """How far behind its place a body comes from, with room to walk."""
        return 2.0 * self.outside_mm + 400.0 if self.ahead else max(0.0, self.deep_mm) + 300.0

    def at(self, frame):
        """Shift, yaw and how far away from the place (-1 .. 1 with the side); None: out of sight."""
        bob = numpy.array([0.0, 12.0 * numpy.sin(1.2 * frame + self.phase), 0.0])
        if self.past:
            x = self.side_in * self.outside_mm * (1.0 - (frame - self.come) / self.walk)
            return (numpy.array([x, 0.0, 0.0]) + bob, -self.side_in * 1.5, 1.0) if abs(x) <= self.outside_mm else None
        arriving = (frame - self.come) / self.walk
        leaving = (frame - self.leave) / self.walk
        side, part, heading = (self.side_in, 1.0 - arriving, -1.0) if leaving < 0.0 else (self.side_out, leaving, 1.0)
        if part > 1.0:
            return None
        part = max(0.0, part)
        facing = side * heading * 1.5 * smoothstep(0.05, 0.45, part)
        if self.ahead:
            path = numpy.array([0.3 * side * self.outside_mm, 0.0, 2.0 * self.outside_mm])
            facing = 0.0 if heading < 0.0 else 3.1 * smoothstep(0.05, 0.35, part)
        else:
            path = numpy.array([side * self.outside_mm, 0.0, self.deep_mm])
        lift = numpy.array([0.0, -self.stand_mm * smoothstep(0.0, 0.4, part), 0.0])
        return path * part + lift + bob * (part > 0.0), facing, smoothstep(0.0, 0.4, part)
