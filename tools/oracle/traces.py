"""Read what host_sim --trace wrote: one JSON file per frame, in a directory per sequence."""

import json
import os


def sequences(root):
    """(name, directory) of every directory under root, or root itself, that holds frames."""
    for directory, below, files in os.walk(root):
        below.sort()
        if any(f.endswith(".json") for f in files):
            name = os.path.relpath(directory, root)
            yield os.path.basename(os.path.abspath(root)) if name == "." else name, directory


def frames(directory):
    """(stem, trace) of every frame in the order of their names."""
    for name in sorted(os.listdir(directory)):
        if name.endswith(".json"):
            with open(os.path.join(directory, name), encoding="utf-8") as file:
                yield name[:-len(".json")], json.load(file)
