"""Records as a table: CSV as RFC 4180 has it, a row per hypothesis.

A frame without hypotheses has one row, in which the hypothesis's fields are empty; so has a frame that
could not be read. What is null or not there is empty. Numbers are printed as the record has them.

A text that a spreadsheet would take for a formula, and run, gets an apostrophe before it. A name of a file may
be such a text; a number never is.
"""

import csv

COLUMNS = (
    "dir", "file", "time_us", "dots", "labelled", "points", "error", "hypothesis", "pixel_u_px", "pixel_v_px",
    "axis_a_px", "axis_b_px", "angle_deg", "distance_mm", "centre_x_mm", "centre_y_mm", "centre_z_mm",
    "rejected", "score", "frame_score", "track", "sigma_mm", "yaw_deg", "pitch_deg", "yaw_sigma_deg", "pitch_sigma_deg", "predicted", "head_rank", "selected", "dropped", "lost",
    "skipped", "strobe", "across_px", "rig", "rig_rotation_x_deg", "rig_rotation_y_deg", "rig_rotation_z_deg",
    "rig_focal_percent", "rig_shift_u_px", "rig_shift_v_px", "rig_depth_known",
)

# What a formula begins with, and the white space that spreadsheets skip before one.
FORMULA = tuple("=+-@\t\r\n")


def text(value):
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str) and value.startswith(FORMULA):
        return "'" + value
    return str(value)


def rig_fields(rig):
    """How the rig has moved. Boards once wrote a word."""
    if not isinstance(rig, dict):
        return {"rig": rig}
    fields = {"rig": rig.get("state"), "across_px": rig.get("across_px"), "rig_focal_percent": rig.get("focal_percent"),
              "rig_depth_known": rig.get("depth_known")}
    for axis, angle in zip("xyz", rig.get("rotation_deg", ())):
        fields["rig_rotation_%s_deg" % axis] = angle
    for axis, shift in zip("uv", rig.get("shift_px", ())):
        fields["rig_shift_%s_px" % axis] = shift
    return fields


def frame_fields(record):
    fields = {key: record.data.get(key) for key in
              ("dir", "file", "time_us", "dots", "labelled", "points", "error", "lost", "skipped", "strobe",
               "across_px")}
    fields.update(rig_fields(record.data.get("rig")))
    dropped = record.data.get("dropped", {})
    fields["dropped"] = " ".join("%s=%s" % (kind, count) for kind, count in dropped.items())
    return fields


def hypothesis_fields(record, index):
    h = record.hypotheses[index]
    plain = ("angle_deg", "distance_mm", "rejected", "score", "frame_score", "track", "sigma_mm")
    fields = {key: h.get(key) for key in plain}
    fields["hypothesis"] = index
    fields["pixel_u_px"], fields["pixel_v_px"] = h["pixel"]
    fields["axis_a_px"], fields["axis_b_px"] = h["axes_px"]
    fields["centre_x_mm"], fields["centre_y_mm"], fields["centre_z_mm"] = h["centre_mm"]
    fields["yaw_deg"], fields["pitch_deg"] = h.get("pose_deg") or (None, None)
    fields["yaw_sigma_deg"], fields["pitch_sigma_deg"] = h.get("pose_sigma_deg") or (None, None)
    fields["predicted"] = h.get("predicted", False)
    fields["head_rank"] = record.heads.index(index) if index in record.heads else None
    fields["selected"] = index == record.head
    return fields


def rows(record):
    frame = frame_fields(record)
    if record.error is not None or not record.hypotheses:
        return [frame]
    return [{**frame, **hypothesis_fields(record, index)} for index in range(len(record.hypotheses))]


def write(records, file):
    """file: text, opened with newline="". Returns the numbers of records and of rows."""
    writer = csv.writer(file)
    writer.writerow(COLUMNS)
    record_count = row_count = 0
    for record in records:
        record_count += 1
        for row in rows(record):
            writer.writerow([text(row.get(column)) for column in COLUMNS])
            row_count += 1
    return record_count, row_count
