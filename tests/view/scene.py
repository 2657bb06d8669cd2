"""A made-up frame, rig and trace whose pictures are known without drawing them.

The rig: 640x480, no lens distortion, the projector beside the camera, so that epipolar lines are level. A step of the
depth grid is 12 pixels, node (23, 23) stands at pixel (319.5, 239.5). The surface is a plane: every column of the grid
10 mm deeper than the one before, from 700 mm.
"""

import json
import os

import numpy as np

WIDTH, HEIGHT, FOCAL = 640, 480, 600.0
CENTRE = (319.5, 239.5)
STEP_PX = 12.0
NEAREST_MM, SLOPE_MM, CLIP_MM = 700, 10, 1160

# (slot or None, pixel, epipolar residual in pixels)
DOTS = [(5, (200.0, 150.0), 0.5), (6, (400.0, 150.0), -0.25), (None, (300.0, 60.0), 0.0)]
ACCEPTED = {"centre": (320.0, 200.0), "a": 80.0, "b": 60.0, "angle": 90.0, "mm": 850}
REJECTED = {"centre": (480.0, 330.0), "a": 60.0, "b": 40.0, "angle": 0.0, "mm": 990}
HEAD = {"centre": (200.0, 320.0), "a": 90.0, "b": 70.0, "angle": 90.0, "mm": 733}
# An open polygon along row 40 of the grid, and the square that is cut out of it.
OPEN = [(4.0, 40.0), (42.0, 40.0)]
PART = [(30.0, 5.0), (40.0, 5.0), (40.0, 12.0), (30.0, 12.0)]
# The part of a slice before that one: only the last is drawn.
EARLIER = [(4.0, 5.0), (10.0, 5.0), (10.0, 12.0), (4.0, 12.0)]
FRAME = "000003.pgm"


def node_px(x, y):
    """A place of the depth grid in the frame."""
    return CENTRE[0] + (x - 23) * STEP_PX, CENTRE[1] + (y - 23) * STEP_PX


def matrix(rows, columns, values):
    return {"type_id": "opencv-matrix", "rows": rows, "cols": columns, "dt": "d", "data": values}


def rig():
    rays = np.zeros((361, 3))
    rays[:, 2] = 1
    return {"image_width": WIDTH, "image_height": HEIGHT,
            "camera_matrix": matrix(3, 3, [FOCAL, 0, CENTRE[0], 0, FOCAL, CENTRE[1], 0, 0, 1]),
            "distortion_coefficients": matrix(1, 5, [0.0] * 5),
            "projector_origin": matrix(3, 1, [12.5, 0, 0]), "dot_rays": matrix(361, 3, rays.ravel().tolist()),
            "near_mm": 400, "far_mm": 2600}


def ellipse(of):
    return {"u_px_q12": round(of["centre"][0] * 4096), "v_px_q12": round(of["centre"][1] * 4096),
            "a_px_q12": round(of["a"] * 4096), "b_px_q12": round(of["b"] * 4096),
            "angle_mdeg": round(of["angle"] * 1000), "distance_mm_q8": of["mm"] * 256}


def hypothesis(of, nest, rejected):
    # area apart, both pass all but the outline below: 7 of 20 not behind
    return dict(ellipse(of), nest=nest, centre_mm_q8=[0, 0, 256000], area_mm2=25100 if rejected is None else 11700,
                curvature_mm_q8=194 * 256, extent_mm_q8=106 * 256, upright_q16=2 * 65536,
                outline={"inside": 24, "above": 23, "above_behind": 23, "beside": 17, "beside_behind": 15, "below": 20,
                         "below_near": 7},
                rejected=rejected)


def positions(steps):
    return [[round(x * 512), round(y * 512)] for x, y in steps]


def levels():
    """Straight contours down the plane's columns, each 10 mm; at one level the open polygon and its part too."""
    levels = []
    for index in range(40):
        contours = [{"closed": False, "x_y_q9": positions([(index + 1, 0), (index + 1, 46)]), "part": []}]
        if index in (8, 10):  # thin contours are drawn at every second one, not here
            part = EARLIER if index == 8 else PART
            contours = [{"closed": False, "x_y_q9": positions(OPEN if part is PART else EARLIER),
                         "part": [{"nest": 0, "slice": (index - 8) // 2, "x_y_q9": positions(part)}]}]
        levels.append({"level_mm_q8": (NEAREST_MM + 10 * (index + 1)) * 256, "contours_dropped": 0,
                       "contour": contours})
    return levels


def labels():
    slots = [None] * 361
    for dot, (slot, _, perp_px) in enumerate(DOTS):
        if slot is not None:
            slots[slot] = {"dot": dot, "t_px_q12": 0, "perp_px_q12": round(perp_px * 4096)}
    return slots


def trace():
    unit = STEP_PX / FOCAL * 11 / 10
    depth = [[(NEAREST_MM + SLOPE_MM * x) * 256 for x in range(47)] for _ in range(47)]
    field = {"centre_x_q28": 0, "centre_y_q28": 0, "unit_q28": round(unit * 2**28)}
    limits = {"area_min_mm2": 12000, "area_max_mm2": 56000, "curvature_min_mm": 60, "curvature_max_mm": 800,
              "extent_min_mm": 65, "upright_min_q16": 62259, "points_min": 13, "above_min_percent": 76,
              "beside_min_percent": 40, "below_min_percent": 45}
    detection = dict(ellipse(HEAD), centre_mm_q8=[0, 0, 830 * 256], semi_mm_q8=[1, 1, 1], head=True, predicted=False,
                   probability_q16=65536 // 4 * 3)
    return {"file": FRAME, "time_us": 300000,
            "dots": {"u_px_q12": [round(px[0] * 4096) for _, px, _ in DOTS],
                     "v_px_q12": [round(px[1] * 4096) for _, px, _ in DOTS]},
            "labels": {"slot": labels()},
            "points": {"x_q28": [0] * 361, "y_q28": [0] * 361, "state": [0] * 361},
            "samples": {"clip_mm_q8": CLIP_MM * 256},
            "surface": {"valid": True, "nearest_mm_q8": NEAREST_MM * 256, "field": field, "depth_mm_q8": depth},
            "cuts": levels(),
            "hypotheses": {"nest": [{"slice": [{"whole": False}] * 2}, {"slice": [{"whole": True}]}]},
            "heads": {"hypothesis": [hypothesis(ACCEPTED, 0, None), hypothesis(REJECTED, 1, "area")], "head": [0],
                      "limits": limits},
            "findings": [detection], "result": {"paper": False, "head": [0], "selected": 0}}


def write(directory):
    """The frames directory; returns the trace's path, which lies in another."""
    frames, traces = os.path.join(directory, "made"), os.path.join(directory, "trace")
    for path in (frames, traces):
        os.makedirs(path, exist_ok=True)
    grey = np.full((HEIGHT, WIDTH), 60, np.uint8)
    with open(os.path.join(frames, FRAME), "wb") as file:
        file.write(b"P5\n%d %d\n255\n" % (WIDTH, HEIGHT) + grey.tobytes())
    with open(os.path.join(frames, "rig.json"), "w", encoding="utf-8") as file:
        json.dump(rig(), file)
    path = os.path.join(traces, "000003.json")
    with open(path, "w", encoding="utf-8") as file:
        json.dump(trace(), file)
    return path
