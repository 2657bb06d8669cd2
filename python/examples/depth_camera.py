#!/usr/bin/env python3
"""Find heads in the depth images of any depth camera.

    depth_camera.py --realsense                                     a RealSense, until Ctrl-C; not tried with a real one
    depth_camera.py --images FX FY CX CY [--unit-mm X] PNG...       16-bit PNG of any camera, X mm to the unit (1)
"""

import argparse
import sys
import time

import isohead
import numpy as np


def realsense():
    """(time in us, depth image) for ever; the rig first. Untried: written from the interface's documentation."""
    import pyrealsense2 as rs  # pip install pyrealsense2

    pipeline = rs.pipeline()
    config = rs.config()
    config.enable_stream(rs.stream.depth, 640, 480, rs.format.z16, 30)
    profile = pipeline.start(config)
    unit_mm = 1000 * profile.get_device().first_depth_sensor().get_depth_scale()
    lens = profile.get_stream(rs.stream.depth).as_video_stream_profile().get_intrinsics()
    yield isohead.depth_rig(lens.width, lens.height, lens.fx, lens.fy, lens.ppx, lens.ppy, depth_scale=unit_mm)
    while True:
        frame = pipeline.wait_for_frames().get_depth_frame()
        yield int(1000 * frame.get_timestamp()), np.asanyarray(frame.get_data())


def images(lens, unit_mm, paths):
    """The same of files, 30 a second."""
    import cv2

    for index, path in enumerate(paths):
        image = cv2.imread(path, cv2.IMREAD_UNCHANGED)
        if image is None or image.dtype != np.uint16:
            sys.exit("%s: no 16-bit picture" % path)
        if index == 0:
            yield isohead.depth_rig(image.shape[1], image.shape[0], *lens, depth_scale=unit_mm)
        yield index * 1_000_000 // 30, image


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("--realsense", action="store_true")
    parser.add_argument("--images", nargs=4, type=float)
    parser.add_argument("--unit-mm", type=float, default=1)
    parser.add_argument("paths", nargs="*")
    options = parser.parse_args()
    if options.realsense == bool(options.images):
        parser.error("--realsense or --images FX FY CX CY PNG...")
    source = realsense() if options.realsense else images(options.images, options.unit_mm, options.paths)
    detector = isohead.Detector(next(source))
    for time_us, depth in source:
        began = time.perf_counter()
        head = detector.process(depth, time_us=time_us).head
        took_ms = 1000 * (time.perf_counter() - began)
        if head is None:
            print("nobody (%.1f ms)" % took_ms)
        else:
            print("track %s: x %.0f y %.0f z %.0f mm, %.0f mm from the camera (%.1f ms)" % (
                head.track, *head.centre_mm, head.distance_mm, took_ms))


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
