#!/usr/bin/env python3
"""Write the unit tests' vectors: inputs and float64 reference results of each stage.

The reference is NumPy and SciPy, by library calls where there are any, never the firmware's own
output. Seeds are fixed: the same files come out every time.
"""

import argparse
import os

import align
import bandpass
import cholesky
import cloud
import dots
import ellipse
import ellipsoid
import evidence
import exposure
import fit
import isohead
import labels
import noise
import points
import pose
import rig
import samples
import scan
import score
import rays
import surface
import surroundings
import tracks
import windows

STAGES = {"rig": rig, "bandpass": bandpass, "noise": noise, "dots": dots, "labels": labels,
          "align": align,           "exposure": exposure, "cloud": cloud, "windows": windows, "points": points,
          "samples": samples, "cholesky": cholesky, "surface": surface, "ellipse": ellipse,
          "rays": rays, "ellipsoid": ellipsoid, "scan": scan, "fit": fit, "evidence": evidence,
          "surroundings": surroundings, "score": score, "tracks": tracks, "pose": pose, "isohead": isohead}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, metavar="DIR", help="for example tests/vectors")
    parser.add_argument("stage", nargs="*", choices=[[], *STAGES], help="only these; default all")
    arguments = parser.parse_args()
    os.makedirs(arguments.out, exist_ok=True)
    for name in arguments.stage or STAGES:
        size = STAGES[name].write_vectors(arguments.out)
        print("%-12s %7d bytes" % (name, size))


if __name__ == "__main__":
    main()
