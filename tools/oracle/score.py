"""Float64 reference of the score: the log-odds as tools/learn computes them, for curves and weights drawn here.

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

MEASURES = 8
CASES = 40


def drawn(random):
    kinds = MEASURES + ray_map.MAPS
    first = random.integers(-60000, 20000, kinds)
    step = random.integers(500, 8000, kinds)
    step[[1, -2]] = 1, 30000  # a measure's as narrow as may be: a sum's would not be known, of its rounding
    at = random.integers(-4000, 4001, (kinds, model.KNOTS))
    at[0] = at[-1] = np.array([-32768, 32767] * model.KNOTS)[:model.KNOTS]
    weight = random.integers(-128, 128, (ray_map.MAPS, MEASURES))
    return model.Score(first, step, at, int(random.integers(-9000, 9000)), None, weight)


def drawn_values(random, score):
    """Within the knots, beyond them, and on them, in Q8; an answer so that it is there with what measures add."""
    position = random.uniform(-1.5, model.KNOTS + 0.5, (CASES, len(score.first_q8)))
    on_knot = random.uniform(size=position.shape) < 0.3
    position[on_knot] = np.round(position[on_knot])
    values = np.rint(score.first_q8 + position * score.step_q8).astype(np.int64)
    beside = np.clip(position[:, :MEASURES], 0, model.KNOTS - 1) @ score.weight_q2.T * 2**(8 - model.WEIGHT_BITS)
    values[:, MEASURES:] -= np.rint(beside).astype(np.int64)
    values[0], values[1] = 2**31 - 1, -2**31
    return values[:, :MEASURES], values[:, MEASURES:]


def write_vectors(directory):
    random = np.random.default_rng(61)
    score = drawn(random)
    measures, answers = drawn_values(random, score)
    logits = score.logits(measures, answers)
    inc = emit.Inc("Curves and weights of a score, measures and answers, and the log-odds that they give.")
    inc.raw("\n#define VECTOR_BIAS_Q10 %d\n" % score.bias_q10)
    inc.struct_array("ih_score_curve", "vector_curves", [
        "%d, %d, {%s}" % (first, step, ", ".join(emit.numbers(at)))
        for first, step, at in zip(score.first_q8, score.step_q8, score.at_q10)])
    inc.raw("\nstatic const int8_t vector_weights[][%d] = {\n%s};\n" % (
        MEASURES, emit.wrap(["{%s}" % ", ".join(emit.numbers(row)) for row in score.weight_q2])))
    inc.struct_array("vector_case", "vector_cases", [
        "{%s}, {%s}, %s" % (", ".join(emit.numbers(measure)), ", ".join(emit.numbers(answer)), emit.number(logit, 6))
        for measure, answer, logit in zip(measures, answers, logits)])
    return inc.write(directory, "score.inc")


def read_header(path):
    """Measures, the score without its maps, and the command that made it."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    weights = re.findall(r"^ +\{([-\d, ]+)\},$", text, re.M)
    rows = re.findall(r"\{(-?\d+), (\d+), \{([-\d, ]+)\}\}, /\* ([\w ]+) \*/", text)
    at = np.array([[int(value) for value in row[2].split(",")] for row in rows])
    score = model.Score(np.array([int(row[0]) for row in rows]), np.array([int(row[1]) for row in rows]), at,
                        int(re.search(r"bias_q10 = (-?\d+),", text)[1]), None,
                        np.array([[int(value) for value in row.split(",")] for row in weights]))
    return [row[3] for row in rows if not row[3].startswith("map ")], score, re.search(r"written by\n \* +(.*)", text)[1]


def measures_of_firmware():
    with open(os.path.join(ROOT, "firmware/core/detect/ih_evidence.h"), encoding="utf-8") as file:
        body = re.search(r"enum ih_evidence_kind \{(.*?)\}", file.read(), re.S)[1]
    return [k.lower() for k in re.findall(r"IH_EVIDENCE_(\w+),", body)]


def read_map(path):
    """The maps, the moves, the promise, and the command that made them."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    bodies = [re.sub(r"/\*.*?\*/", "", part.split("};")[0]) for part in text.split("= {")[1:]]
    words = np.array([int(word, 16) for word in re.findall(r"0x[0-9a-f]+", bodies[0])])
    step_mm_q12, steps = np.split(np.array([int(number) for number in re.findall(r"-?\d+", bodies[1])]), [3])
    moves = steps.reshape(-1, 3), step_mm_q12
    bias, *parts = (int(number) for number in re.findall(r"-?\d+", bodies[2]))
    return ray_map.unpacked(words.reshape(ray_map.PLACES, -1)), moves, (bias, np.array(parts)), re.search(r"written by\n \* +(.*)", text)[1]


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
    measures, learnt, command = read_header(path)
    maps, moves, promise, map_command = read_map(map_path)
    same = (is_written_by(lambda again: model.write(again, learnt, measures, command), path)
            and is_written_by(lambda again: ray_map.write(again, maps, moves, promise, map_command), map_path))
    if command != map_command:
        print("%s: learnt at another time than %s" % (path, map_path))
        same = False
    with open(os.path.join(ROOT, "docs/pictures/maps.svg"), encoding="utf-8") as picture:
        if picture.read() != draw_maps.text():
            print("docs/pictures/maps.svg: of other maps; tools/learn/draw_maps.py draws it")
            same = False
    if measures != measures_of_firmware():
        print("%s: not the measures of ih_evidence.h" % path)
        same = False
    return 0 if same else 1


if __name__ == "__main__":
    PARSER = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    PARSER.add_argument("--check", required=True, metavar="FOLDER")
    sys.exit(check(PARSER.parse_args().check))
