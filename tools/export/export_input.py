"""What host_sim wrote and what it read, as docs/contract.md describes it: records, trace, rig, frames.

Everything is checked before it is handed on, so that the writers can rely on it. What is wrong is reported by
Refused: file, line where there are lines, what was found and what was expected.
"""

import decimal
import json
import os

SLOTS = 361
GRID = 47  # nodes of the surface in a row and in a column
# A PGM may be 1280x800, a record or a trace is far smaller: what is larger is something else.
FILE_MAX_BYTES = 64 << 20
LINE_MAX_BYTES = 1 << 20


class Refused(Exception):
    """Input that is wrong, or an output that cannot be written."""


def read_bytes(path):
    try:
        with open(path, "rb") as file:
            data = file.read(FILE_MAX_BYTES + 1)
    except OSError as error:
        raise Refused("%s: %s" % (path, error.strerror)) from None
    if len(data) > FILE_MAX_BYTES:
        raise Refused("%s: more than %d bytes" % (path, FILE_MAX_BYTES))
    return data


def no_constant(name):
    raise ValueError("%s is no number" % name)


def parse(data, where, **options):
    """JSON text to values; where: file, or file and line."""
    try:
        return json.loads(data.decode("utf-8"), parse_constant=no_constant, **options)
    except UnicodeDecodeError as error:
        raise Refused("%s: byte %d is no UTF-8" % (where, error.start + 1)) from None
    except json.JSONDecodeError as error:
        raise Refused("%s: no JSON, line %d column %d: %s" %
                      (where, error.lineno, error.colno, error.msg)) from None
    except (ValueError, RecursionError) as error:
        raise Refused("%s: no JSON: %s" % (where, error)) from None


def is_int(value):
    return isinstance(value, int) and not isinstance(value, bool)


def is_raw(value):
    return is_int(value) and -2**31 <= value < 2**31


def is_time(value):
    """What a file can have as nanoseconds since its start."""
    return is_int(value) and 0 <= value < 2**63 // 1000


def is_number(value):
    return (is_int(value) or isinstance(value, (float, decimal.Decimal))) and abs(value) < 10**12


def is_index(value):
    return is_int(value) and value >= 0


def is_bool(value):
    return isinstance(value, bool)


def is_text(value):
    return isinstance(value, str)


def is_object(value):
    return isinstance(value, dict)


def is_rig(value):
    return is_text(value) or is_object(value)


def list_of(good, length=None):
    return lambda value: (isinstance(value, list) and (length is None or len(value) == length)
                          and all(good(item) for item in value))


def or_null(good):
    return lambda value: value is None or good(value)


def take(holder, key, good, expected, where, path=""):
    """holder[key], which good() must accept."""
    if not isinstance(holder, dict) or key not in holder:
        raise Refused("%s: no %s%s: %s expected" % (where, path, key, expected))
    value = holder[key]
    if not good(value):
        shown = json.dumps(value, default=str)
        raise Refused("%s: %s%s is %s: %s expected" %
                      (where, path, key, shown if len(shown) <= 60 else shown[:60] + " ...", expected))
    return value


# ---------------------------------------------------------------- records

# A hypothesis: key, check, what is expected; then those that may be left out.
HYPOTHESIS = (
    ("pixel", list_of(is_number, 2), "[u, v]"),
    ("axes_px", list_of(is_number, 2), "[a, b]"),
    ("angle_deg", is_number, "a number"),
    ("distance_mm", is_number, "a number"),
    ("centre_mm", list_of(is_number, 3), "[x, y, z]"),
    ("rejected", or_null(is_text), "null or a reason"),
)
HYPOTHESIS_ADDED = (
    ("score", is_number, "a number"),
    ("frame_score", is_number, "a number"),
    ("track", is_index, "a whole number"),
    ("sigma_mm", is_number, "a number"),
    ("pose_deg", or_null(list_of(is_number, 2)), "[yaw, pitch] or null"),
    ("pose_sigma_deg", or_null(list_of(is_number, 2)), "[yaw, pitch] or null"),
    ("predicted", is_bool, "true or false"),
)
RECORD_ADDED = (
    ("dir", is_text, "a text"),
    ("points", is_index, "a whole number"),
    ("lost", is_index, "a whole number"),
    ("skipped", is_index, "a whole number"),
    ("strobe", is_text, "a text"),
    ("across_px", is_number, "a number"),
    ("rig", is_rig, "an object, or a word of older boards"),
    ("dropped", is_object, "an object"),
)


class Record:
    """One line of host_sim --json, or of a board's output. Numbers with decimals are Decimal and print as
    they were written."""

    def __init__(self, data, where):
        self.data = data
        self.where = where
        self.file = take(data, "file", is_text, "the frame's name", where)
        for key, good, expected in RECORD_ADDED:
            if key in data:
                take(data, key, good, expected, where)
        self.directory = data.get("dir")
        self.error = take(data, "error", is_text, "a text", where) if "error" in data else None
        if self.error is None:
            self.check_frame()

    def check_frame(self):
        data, where = self.data, self.where
        self.time_us = take(data, "time_us", is_time, "microseconds from 0 on", where)
        for key in ("dots", "labelled"):
            take(data, key, is_index, "a whole number", where)
        self.hypotheses = take(data, "hypotheses", list_of(is_object), "a list of hypotheses", where)
        for index, hypothesis in enumerate(self.hypotheses):
            path = "hypotheses[%d]." % index
            for key, good, expected in HYPOTHESIS:
                take(hypothesis, key, good, expected, where, path)
            for key, good, expected in HYPOTHESIS_ADDED:
                if key in hypothesis:
                    take(hypothesis, key, good, expected, where, path)
        count = len(self.hypotheses)

        def known(index):
            return is_index(index) and index < count
        self.heads = take(data, "heads", list_of(known), "a list of hypotheses' indices below %d" % count, where)
        self.head = take(data, "head", or_null(known), "null or a hypothesis's index below %d" % count, where)


def read_records(path):
    """All records of a file, one by one: a board may have written for days. Empty lines are skipped: its serial
    output starts with one."""
    count = 0
    try:
        with open(path, "rb") as file:
            for number, line in enumerate(iter(lambda: file.readline(LINE_MAX_BYTES), b""), 1):
                if line.strip():
                    where = "%s:%d" % (path, number)
                    yield Record(parse(line, where, parse_float=decimal.Decimal), where)
                    count += 1
    except OSError as error:
        raise Refused("%s: %s" % (path, error.strerror)) from None
    if count == 0:
        raise Refused("%s: no records: a line of JSON per frame expected, as host_sim --json writes" % path)


def records_of(records, frames, path):
    """Those of one frames directory: where a run had several, each record names its own."""
    others = set()
    count = 0
    for record in records:
        if record.directory is None or os.path.realpath(record.directory) == os.path.realpath(frames):
            count += 1
            yield record
        else:
            others.add(record.directory)
    if count == 0:
        raise Refused("%s: no records of %s, only of %s (as seen from where host_sim ran)" %
                      (path, frames, ", ".join(sorted(others))))


# ---------------------------------------------------------------- the rig

class Rig:
    """rig.json, as far as it says how the camera sees."""

    def __init__(self, path):
        data = parse(read_bytes(path), path)
        self.is_range = take(data, "kind", lambda v: v in ("dots", "range"), '"dots" or "range"', path) == "range" \
            if is_object(data) and "kind" in data else False
        self.width = take(data, "image_width", lambda v: is_int(v) and v > 0, "pixels", path)
        self.height = take(data, "image_height", lambda v: is_int(v) and v > 0, "pixels", path)
        self.near_mm = take(data, "near_mm", lambda v: is_number(v) and v > 0, "mm", path)
        self.far_mm = take(data, "far_mm", lambda v: is_number(v) and v > self.near_mm,
                           "more mm than near_mm", path)
        self.matrix = self.numbers(data, "camera_matrix", 9, path)
        self.lens = self.numbers(data, "distortion_coefficients", 5, path)
        self.up = take(data, "up", list_of(is_number, 3), "[x, y, z]", path) if "up" in data else [0, -1, 0]
        self.projector_mm = None if self.is_range else self.numbers(data, "projector_origin", 3, path)

    @staticmethod
    def numbers(data, key, length, path):
        matrix = take(data, key, is_object, "a matrix", path)
        return take(matrix, "data", list_of(is_number, length), "%d numbers" % length, path, key + ".")


# ---------------------------------------------------------------- a frame's picture

class Picture:
    """A binary PGM. data: 8 bits per pixel, or 16, the low byte first."""

    def __init__(self, path, rig):
        text = read_bytes(path)
        self.width, self.height, self.maximum, start = self.header(text, path)
        if (self.width, self.height) != (rig.width, rig.height):
            raise Refused("%s: %dx%d pixels, the rig has %dx%d" %
                          (path, self.width, self.height, rig.width, rig.height))
        self.bytes_per_pixel = 1 if self.maximum < 256 else 2
        size = self.width * self.height * self.bytes_per_pixel
        data = text[start:start + size]
        if len(data) < size:
            raise Refused("%s: %d bytes of pixels, %d expected" % (path, len(data), size))
        if self.bytes_per_pixel == 2:
            swapped = bytearray(size)
            swapped[0::2], swapped[1::2] = data[1::2], data[0::2]
            data = bytes(swapped)
        self.data = data

    @staticmethod
    def header(text, path):
        """Width, height, maximum, and where the pixels start."""
        fields, at = [], 2
        while len(fields) < 3 and at < len(text):
            if text[at:at + 1] == b"#":
                at = (text.find(b"\n", at) + 1) or len(text)
            elif text[at:at + 1].isspace():
                at += 1
            else:
                end = at
                while text[end:end + 1].isdigit():
                    end += 1
                if end == at:
                    break
                fields.append(int(text[at:end]))
                at = end
        good = text[:2] == b"P5" and len(fields) == 3 and text[at:at + 1].isspace() and 0 < fields[2] < 65536
        if not good:
            raise Refused("%s: no binary PGM: P5, width, height and a maximum up to 65535 expected" % path)
        return (*fields, at + 1)


# ---------------------------------------------------------------- a frame's trace

class Trace:
    """What host_sim --trace wrote of a frame, in mm and pixels."""

    def __init__(self, path, record):
        self.path = path
        self.data = parse(read_bytes(path), path)
        self.check_frame(record)
        self.read_dots()
        # rows: from the camera frame to the one that points, surface and ellipsoids are in
        self.level = self.read_level()
        self.points_mm = self.read_points()
        self.depths_mm = self.read_depths()
        self.surface_mm = self.read_surface()
        self.semi_axes_mm = self.read_semi_axes(len(record.hypotheses))

    def stage(self, name):
        return take(self.data, name, is_object, "an object", self.path)

    def column(self, stage, key, length):
        return take(self.stage(stage), key, list_of(is_raw, length), "%d integers" % length, self.path, stage + ".")

    def check_frame(self, record):
        """A trace that another run left there is not the record's."""
        pairs = (("file", is_text, self.data, "file"), ("time_us", is_time, self.data, "time_us"),
                 ("dot_count", is_index, self.stage("dots"), "dots"),
                 ("labelled_count", is_index, self.stage("labels"), "labelled"))
        for key, good, holder, of_record in pairs:
            value = take(holder, key, good, "what the record has", self.path)
            if value != record.data[of_record]:
                raise Refused("%s: %s is %s, but %s of %s is %s: not of the same run" %
                              (self.path, key, value, of_record, record.where, record.data[of_record]))

    def read_dots(self):
        count = self.stage("dots")["dot_count"]
        self.dots_px = list(zip((u / 4096 for u in self.column("dots", "u_px_q12", count)),
                                (v / 4096 for v in self.column("dots", "v_px_q12", count))))
        slots = take(self.stage("labels"), "slot", list_of(or_null(is_object), SLOTS),
                     "%d objects or nulls" % SLOTS, self.path, "labels.")
        # slot -> dot
        self.dot_of_slot = {
            slot: take(entry, "dot", lambda v: is_index(v) and v < count, "a dot's index below %d" % count,
                       self.path, "labels.slot[%d]." % slot)
            for slot, entry in enumerate(slots) if entry is not None}

    def read_level(self):
        if "level_q30" not in self.data:
            return [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        raw = take(self.data, "level_q30", list_of(is_raw, 9), "9 integers", self.path)
        return [[value / 2**30 for value in raw[3 * i:3 * i + 3]] for i in range(3)]

    def of_camera(self, position):
        """A position of the level frame."""
        if "level_q30" not in self.data:
            return position
        return tuple(sum(row[axis] * value for row, value in zip(self.level, position)) for axis in range(3))

    def depth(self, position):
        """Of a position of the camera frame, as the surface has it."""
        return position[2] if "level_q30" not in self.data else sum(a * b for a, b in zip(self.level[2], position))

    def read_points(self):
        """(slot, x, y, z) of every slot that was seen."""
        columns = [self.column("points", key, SLOTS) for key in ("x_q28", "y_q28", "depth_mm_q8", "state")]
        return [(slot, *self.of_camera((x / 2**28 * depth / 256, y / 2**28 * depth / 256, depth / 256)))
                for slot, (x, y, depth, state) in enumerate(zip(*columns)) if state == 1]

    def read_depths(self):
        """The depths that matter, nearest and farthest, or None where the frame has none."""
        near, far = (take(self.stage("samples"), key, is_raw, "an integer", self.path, "samples.") / 256
                     for key in ("nearest_mm_q8", "clip_mm_q8"))
        return (near, far) if 0 < near < far else None

    def read_surface(self):
        """GRID rows of GRID nodes (x, y, z), or None where the frame has no surface."""
        surface = self.stage("surface")
        if not take(surface, "valid", is_bool, "true or false", self.path, "surface."):
            return None
        field = take(surface, "field", is_object, "an object", self.path, "surface.")
        middle_x, middle_y, unit = (
            take(field, key, is_raw, "an integer", self.path, "surface.field.") / 2**28
            for key in ("centre_x_q28", "centre_y_q28", "unit_q28"))
        rows = take(surface, "depth_mm_q8", list_of(list_of(is_raw, GRID), GRID),
                    "%d rows of %d integers" % (GRID, GRID), self.path, "surface.")
        slopes = [(k - (GRID - 1) / 2) * unit * 10 / 11 for k in range(GRID)]  # 10/11 field units a step
        return [[self.of_camera(((middle_x + across) * depth / 256, (middle_y + down) * depth / 256, depth / 256))
                 for across, depth in zip(slopes, row)] for down, row in zip(slopes, rows)]

    def read_semi_axes(self, count):
        """The fitted ellipsoids' semi-axes, a triple per hypothesis of the record. None with --paper, which
        has hypotheses without ellipsoids."""
        detections = take(self.data, "findings", list_of(is_object), "a list of detections", self.path)
        if not detections:
            return None
        if len(detections) != count:
            raise Refused("%s: %d detections, but %d hypotheses in the record: not of the same run" %
                          (self.path, len(detections), count))
        return [[value / 256 for value in take(detection, "semi_mm_q8", list_of(is_raw, 3), "3 integers",
                                               self.path, "findings[%d]." % index)]
                for index, detection in enumerate(detections)]


def trace_of(folder, record):
    # Frames that differ in their suffix alone keep it.
    path = os.path.join(folder, record.file + ".json")
    if not os.path.exists(path):
        path = os.path.join(folder, os.path.splitext(record.file)[0] + ".json")
    if not os.path.exists(path):
        inner = sorted(entry for entry in os.listdir(folder)
                       if os.path.isfile(os.path.join(folder, entry, os.path.basename(path)))) \
            if os.path.isdir(folder) else []
        hint = "; name one of the folders in it: %s" % ", ".join(inner) if inner else ""
        raise Refused("%s: the trace of %s is not there%s" % (path, record.where, hint))
    return Trace(path, record)
