#!/usr/bin/env python3
"""Find the head in pictures of laser dots and draw it: draw.py RIG PICTURE... OUT.png (OUT shows the last one)."""

import sys

import cv2
import isohead
import numpy as np


def draw(image, rig, points_mm, result):
    """The picture in colour, three times as bright, with the measured points, near ones red and far ones blue, and the heads."""
    drawn = cv2.cvtColor(cv2.convertScaleAbs(image, alpha=3), cv2.COLOR_GRAY2BGR)
    points = np.asarray(points_mm).reshape(-1, 3)
    points = points[np.isfinite(points[:, 2])]
    if len(points):
        still = np.zeros(3)
        pixels, _ = cv2.projectPoints(points, still, still, np.array(rig.camera_matrix), np.array(rig.distortion))
        near, far = rig.range_mm
        for (u, v), z in zip(pixels.reshape(-1, 2), points[:, 2]):
            shade = int(255 * (z - near) / (far - near))
            cv2.circle(drawn, (round(u), round(v)), 3, (shade, 0, 255 - shade), 1)
    for head in result.heads:
        colour = (0, 165, 255) if head is result.head else (0, 90, 140)
        centre, axes = tuple(map(round, head.pixel)), tuple(map(round, head.axes_px))
        cv2.ellipse(drawn, centre, axes, head.angle_deg, 0, 360, colour, 2)
        x, y, z = head.centre_mm
        text = "track %s: %.0f %.0f %.0f mm, %.0f %%" % (head.track, x, y, z, 100 * (head.score or 0))
        cv2.putText(drawn, text, (centre[0] - 150, max(20, centre[1] - axes[0] - 8)), cv2.FONT_HERSHEY_SIMPLEX, 0.5, colour)
    return drawn


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    rig = isohead.load_rig(sys.argv[1])
    detector = isohead.Detector(rig)
    for index, path in enumerate(sys.argv[2:-1]):
        image = cv2.imread(path, cv2.IMREAD_GRAYSCALE)
        if image is None:
            sys.exit("%s: no picture" % path)
        result = detector.process(image, time_us=40000 * index)
    cv2.imwrite(sys.argv[-1], draw(image, rig, detector.points_mm(), result))


if __name__ == "__main__":
    main()
