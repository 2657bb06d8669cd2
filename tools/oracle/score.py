"""Float64 reference of the score: the log-odds as tools/learn computes them, for curves and trees drawn here.

    score.py --check FOLDER      are ih_score_weights.h and ih_surroundings_map.h what tools/learn writes, and drawn?
"""

import argparse
import os
import re
import sys
import tempfile

import numpy as np

import emit

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "learn"))
import draw_maps  # pylint: disable=wrong-import-position
import model  # pylint: disable=wrong-import-position
import ray_map  # pylint: disable=wrong-import-position

KINDS = 12  # no more than the firmware has; its test leaves the others flat
CASES = 40


def drawn_curves(random):
    first = random.integers(-60000, 20000, KINDS)
    step = np.append(random.integers(1, 8000, KINDS - 2), [1, 30000])
    at = random.integers(-4000, 4001, (KINDS, model.KNOTS))
    at[0] = np.array([-32768, 32767] * model.KNOTS)[:model.KNOTS]
    bias = int(random.integers(-9000, 9000))
    kind = random.integers(0, KINDS, model.QUESTIONS)
    limit = random.integers(0, (model.KNOTS - 1) * model.PLACES + 2, kind.shape)
    question = random.integers(0, model.QUESTIONS, (model.TREES, model.BRANCHES))
    leaf = random.integers(-128, 128, (model.TREES, model.BRANCHES + 1))
    return model.Curves(first, step, at, bias, kind, limit, question, leaf)


def drawn_evidence(random, curves):
    """Within the knots, beyond them, and on them, in Q8."""
    position = random.uniform(-1.5, model.KNOTS + 0.5, (CASES, KINDS))
    on_knot = random.uniform(size=position.shape) < 0.3
    position[on_knot] = np.round(position[on_knot])
    evidence = np.rint(curves.first_q8 + position * curves.step_q8).astype(np.int64)
    evidence[0], evidence[1] = 2**31 - 1, -2**31
    return evidence


def write_vectors(directory):
    random = np.random.default_rng(61)
    curves = drawn_curves(random)
    evidence = drawn_evidence(random, curves)
    logits = curves.logits(evidence / 256)
    together = curves.leaves(evidence / 256)
    inc = emit.Inc("Curves and trees of a score, evidence, and the log-odds that they give, those of the trees alone behind.")
    inc.raw("\n#define VECTOR_KINDS %d\n#define VECTOR_BIAS_Q10 %d\n" % (KINDS, curves.bias_q10))
    inc.struct_array("ih_score_curve", "vector_curves", [
        "%d, %d, {%s}" % (first, step, ", ".join(emit.numbers(at)))
        for first, step, at in zip(curves.first_q8, curves.step_q8, curves.at_q10)])
    inc.struct_array("ih_score_question", "vector_questions", ["%d, %d" % pair for pair in zip(curves.kind, curves.limit)])
    inc.struct_array("ih_score_tree", "vector_trees", [
        "{%s}, {%s}" % tuple(", ".join(emit.numbers(part)) for part in tree) for tree in zip(curves.question, curves.leaf_q8)])
    inc.struct_array("vector_case", "vector_cases", [
        "{%s}, %s, %s" % (", ".join(emit.numbers(row)), emit.number(logit, 6), emit.number(leaves, 10))
        for row, logit, leaves in zip(evidence, logits, together)])
    return inc.write(directory, "score.inc")


def read_header(path):
    """Kinds, curves and the command that made them."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    trees = re.findall(r"^ +\{\{([\d, ]+)\}, \{([-\d, ]+)\}\},$", text, re.M)
    question, leaf = ([[int(value) for value in part.split(",")] for part in column] for column in zip(*trees))
    listed = re.search(r"\.question = \{(.*?)\n    \}", text, re.S)[1]
    kind, limit = zip(*((int(kind), int(limit)) for kind, limit in re.findall(r"\{(\d+), (\d+)\}", listed)))
    rows = re.findall(r"\[IH_EVIDENCE_(\w+)\] = \{(-?\d+), (\d+), \{([-\d, ]+)\}\},", text)
    at = np.array([[int(value) for value in row[3].split(",")] for row in rows])
    curves = model.Curves(np.array([int(row[1]) for row in rows]),
                          np.array([int(row[2]) for row in rows]), at,
                          int(re.search(r"bias_q10 = (-?\d+),", text)[1]), kind, limit, question, leaf)
    return [row[0].lower() for row in rows], curves, re.search(r"written by\n \* +(.*)", text)[1]


def kinds_of_firmware():
    with open(os.path.join(ROOT, "firmware/core/detect/ih_evidence.h"), encoding="utf-8") as file:
        body = re.search(r"enum ih_evidence_kind \{(.*?)\}", file.read(), re.S)[1]
    return [k.lower() for k in re.findall(r"IH_EVIDENCE_(\w+),", body)]


def read_map(path):
    """The maps, the moves, the promise, and the command that made them."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    bodies = [re.sub(r"/\*.*?\*/", "", part.split("};")[0]) for part in text.split("= {")[1:]]
    words, steps = ([int(word, 16) for word in re.findall(r"0x[0-9a-f]+", body)] for body in bodies[:2])
    step_mm_q8 = [int(number) for number in re.search(r"\{(\d+), (\d+)\}", bodies[1]).groups()]
    moves = ray_map.unpacked(steps, 2), step_mm_q8
    bias, *parts = (int(number) for number in re.findall(r"-?\d+", bodies[2]))
    return ray_map.unpacked(words), moves, (bias, np.array(parts)), re.search(r"written by\n \* +(.*)", text)[1]


def is_written_by(write, path):
    with tempfile.TemporaryDirectory() as work:
        again = os.path.join(work, "again.h")
        write(again)
        with open(path, encoding="utf-8") as one, open(again, encoding="utf-8") as other:
            same = one.read() == other.read()
    if not same:
        print("%s: not as tools/learn writes it" % path)
    return same


def check(folder):
    path, map_path = (os.path.join(folder, name) for name in ("ih_score_weights.h", "ih_surroundings_map.h"))
    kinds, curves, command = read_header(path)
    maps, moves, promise, map_command = read_map(map_path)
    same = (is_written_by(lambda again: model.write(again, curves, kinds, command), path)
            and is_written_by(lambda again: ray_map.write(again, maps, moves, promise, map_command), map_path))
    if command != map_command:
        print("%s: learnt at another time than %s" % (path, map_path))
        same = False
    with open(os.path.join(ROOT, "docs/pictures/maps.svg"), encoding="utf-8") as picture:
        if picture.read() != draw_maps.text():
            print("docs/pictures/maps.svg: of other maps; tools/learn/draw_maps.py draws it")
            same = False
    if kinds != kinds_of_firmware():
        print("%s: not the evidence of ih_evidence.h" % path)
        same = False
    return 0 if same else 1


if __name__ == "__main__":
    PARSER = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    PARSER.add_argument("--check", required=True, metavar="FOLDER")
    sys.exit(check(PARSER.parse_args().check))
