#!/usr/bin/env python3
"""How well the whole method works, what each part of it brings, and what it costs.

evaluate.py --host-sim PROGRAM --render PROGRAM --work DIR [--data DIR] [--quick] [--no-pictures]

Renders the scenes of scenes.py into DIR/frames (those that are there stay), runs host_sim over them
and over the data sets in every variant of runs.py, scores the records by docs/contract.md and prints
the tables. DIR gets report.md, results.json and failures-*.png: every frame where the full method
was not right. The same programs and data give the same files.
"""

import argparse
import json
import os
import sys

import report
import runs
import scenes


def parse():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--host-sim", required=True)
    parser.add_argument("--render", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--data", default="", help="folder with dots/ and range/")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--quick", action="store_true",
                        help="two scenes, three variants, neither pictures nor costs")
    parser.add_argument("--no-pictures", action="store_true")
    parser.add_argument("--no-costs", action="store_true")
    parser.add_argument("--kind", action="append", help="only scenes of this kind; repeatable")
    return parser.parse_args()


def say(scene, result):
    counts = result.counts[runs.FULL]
    print("%-34s %3d of %3d right" % (scene.name, counts.right_count, counts.frame_count),
          file=sys.stderr, flush=True)


def chosen_scenes(arguments):
    if arguments.quick:
        return scenes.quick_scenes()
    chosen = scenes.all_scenes(arguments.data)
    if not any(scene.directory for scene in chosen):
        print("evaluate: no data sets in '%s': rendered scenes only" % arguments.data, file=sys.stderr)
    return [s for s in chosen if not arguments.kind or s.kind in arguments.kind]


def main():
    arguments = parse()
    programs = {"host_sim": os.path.abspath(arguments.host_sim),
                "render": os.path.abspath(arguments.render)}
    variants = list(runs.VARIANTS)
    if arguments.quick:
        variants = [runs.FULL, runs.PAPER, "without scan"]
    chosen = chosen_scenes(arguments)
    if not chosen:
        print("evaluate: no scene of this kind", file=sys.stderr)
        return 2
    pictures = not (arguments.quick or arguments.no_pictures)
    results = runs.run_all(programs, arguments.work, chosen, variants, pictures, arguments.jobs, say)
    costs = ""
    if not (arguments.quick or arguments.no_costs):
        import cost  # pylint: disable=import-outside-toplevel
        costs = cost.text(programs, arguments.data)
    text = report.text(results, costs)
    print(text)
    with open(os.path.join(arguments.work, "report.md"), "w", encoding="utf-8") as file:
        file.write(text)
    with open(os.path.join(arguments.work, "results.json"), "w", encoding="utf-8") as file:
        json.dump(report.as_json(results), file, indent=1)
        file.write("\n")
    if pictures:
        import sheets  # pylint: disable=import-outside-toplevel
        sheets.draw_all(results, arguments.work, arguments.jobs)
    return 0


if __name__ == "__main__":
    sys.exit(main())
