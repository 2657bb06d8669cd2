"""The Python package against host_sim: the same records, number for number; what is refused; that nothing is copied.

Needs the environment: HOST_SIM, the program, and FRAMES, a folder with rendered sequences.
"""

import io
import json
import os
import runpy
import subprocess
import sys
import threading
import tracemalloc
from decimal import ROUND_HALF_UP, Decimal
from pathlib import Path

import numpy as np
import pytest

import isohead

HOST_SIM = os.environ["HOST_SIM"]
FRAMES = Path(os.environ["FRAMES"])
PYTHON = Path(__file__).parents[1]
WIDTH, HEIGHT, FOCAL = 320, 240, 290.0


def read_pgm(path):
    kind, size, maximum, samples = path.read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    assert kind == b"P5"
    return np.frombuffer(samples, ">u2" if int(maximum) > 255 else np.uint8).reshape(height, width).astype(
        np.uint16 if int(maximum) > 255 else np.uint8)


def records_of(directory, *options):
    lines = subprocess.run([HOST_SIM, "--json", *options, directory], check=True, stdout=subprocess.PIPE, text=True).stdout
    return lines.splitlines()


def near(value, text, decimals):
    """A value that is exact in binary is the printed number, rounded half away from zero; others to half a step."""
    step = Decimal(1).scaleb(-decimals)
    exact = Decimal(value).quantize(step, ROUND_HALF_UP) == Decimal(str(text))
    return exact or abs(value - text) <= 0.5 * float(step) + 1e-9


def check_hypothesis(found, record):
    for name, decimals in (("pixel", 2), ("axes_px", 2), ("centre_mm", 1)):
        values = getattr(found, name)
        assert len(values) == len(record[name])
        assert all(near(a, b, decimals) for a, b in zip(values, record[name])), name
    assert near(found.distance_mm, record["distance_mm"], 1)
    assert abs(found.angle_deg - record["angle_deg"]) <= 0.1  # 179.97 is printed as 179.9: below 180
    assert found.rejected == record["rejected"]
    assert found.track == record.get("track")
    assert found.predicted == record.get("predicted", False)
    for name, decimals in (("score", 3), ("frame_score", 3), ("sigma_mm", 1)):
        value = getattr(found, name)
        assert (value is None) == (name not in record), name
        assert value is None or near(value, record[name], decimals), name


def check(result, line):
    record = json.loads(line)
    assert (result.time_us, result.dots, result.labelled) == (record["time_us"], record["dots"], record["labelled"])
    assert result.points == record.get("points") and result.dropped == record.get("dropped", {})
    assert len(result.hypotheses) == len(record["hypotheses"])
    for found, expected in zip(result.hypotheses, record["hypotheses"]):
        check_hypothesis(found, expected)
    assert [result.hypotheses[index] for index in record["heads"]] == list(result.heads)
    assert result.head is (None if record["head"] is None else result.hypotheses[record["head"]])
    assert (result.rig is None) == ("rig" not in record)
    if result.rig:
        rig = record["rig"]
        assert (result.rig.state, result.rig.depth_known) == (rig["state"], rig["depth_known"])
        assert (result.rig.across_px is None) == (rig["across_px"] is None)
        for name, decimals in (("rotation_deg", 3), ("sigma_deg", 3), ("shift_px", 2)):
            assert all(near(a, b, decimals) for a, b in zip(getattr(result.rig, name), rig[name])), name
        assert near(result.rig.focal_percent, rig["focal_percent"], 2)


def check_directory(directory, suffix=".pgm", *, paper=False):
    detector = isohead.Detector(isohead.load_rig(directory / "rig.json"), paper=paper)
    lines = records_of(directory, *(["--paper"] if paper else []))
    names = sorted(path.name for path in directory.iterdir() if path.suffix == suffix)
    assert len(lines) == len(names) > 0
    heads = 0
    for name, line in zip(names, lines):
        time_us = json.loads(line)["time_us"]
        if suffix == ".xyz":
            result = detector.process_points(np.loadtxt(directory / name, ndmin=2), time_us=time_us)
        else:
            result = detector.process(read_pgm(directory / name), time_us=time_us)
        check(result, line)
        assert detector.record(name) == line
        heads += len(result.heads)
    return heads


def depth_of(frame):
    """Depth in mm of a head with a brow and hair on shoulders before a wall, which move to the right."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    x, y = (u - (WIDTH - 1) / 2) / FOCAL, (v - (HEIGHT - 1) / 2) / FOCAL
    depth = np.full((HEIGHT, WIDTH), 2000.0)
    for centre, axes in (((20 + 4 * frame, -60, 1000), (76, 112, 96)), ((20 + 4 * frame, 250, 1050), (220, 170, 120))):
        (cx, cy, cz), (ax, ay, az) = centre, axes
        a = (x / ax) ** 2 + (y / ay) ** 2 + 1 / az ** 2
        b = x * cx / ax ** 2 + y * cy / ay ** 2 + cz / az ** 2
        root = b * b - a * ((cx / ax) ** 2 + (cy / ay) ** 2 + (cz / az) ** 2 - 1)
        body = np.where(root > 0, (b - np.sqrt(np.maximum(root, 0))) / a, 2000)
        if cz == 1000:  # an even surface is a ball's
            body -= np.where(root > 0, 8 * np.sin((y * body - cy) / 9), 0)
        depth = np.minimum(depth, body)
    return np.rint(depth).astype(np.uint16)


RANGE_RIG = {
    "kind": "range", "image_width": WIDTH, "image_height": HEIGHT, "near_mm": 400, "far_mm": 4000,
    "camera_matrix": {"type_id": "opencv-matrix", "rows": 3, "cols": 3, "dt": "d",
                      "data": [FOCAL, 0, (WIDTH - 1) / 2, 0, FOCAL, (HEIGHT - 1) / 2, 0, 0, 1]},
    "distortion_coefficients": {"type_id": "opencv-matrix", "rows": 1, "cols": 5, "dt": "d", "data": [0] * 5}}


@pytest.fixture(name="ranges")
def make_ranges(tmp_path):
    """A range directory, and the same frames as lists of points."""
    for folder, scale in (("images", 1), ("fifths", 0.2), ("lists", 1)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "rig.json").write_text(json.dumps({**RANGE_RIG, "depth_scale": scale}), encoding="utf-8")
    v, u = np.mgrid[:HEIGHT:6, :WIDTH:6]
    for index in range(6):
        depth = depth_of(index)
        for folder, factor in (("images", 1), ("fifths", 5)):
            (tmp_path / folder / ("%06d.pgm" % index)).write_bytes(
                b"P5\n%d %d\n65535\n" % (WIDTH, HEIGHT) + (factor * depth).astype(">u2").tobytes())
        z = depth[::6, ::6].astype(float)
        points = np.stack([(u - (WIDTH - 1) / 2) / FOCAL * z, (v - (HEIGHT - 1) / 2) / FOCAL * z, z], -1)
        np.savetxt(tmp_path / "lists" / ("%06d.xyz" % index), points.reshape(-1, 3), "%.6f")
    return tmp_path


@pytest.mark.parametrize("sequence", ["sequence1", "sequence2"])
@pytest.mark.parametrize("paper", [False, True])
def test_dots_are_those_of_host_sim(sequence, paper):
    assert check_directory(FRAMES / sequence, paper=paper) > 20


def test_ranges_are_those_of_host_sim(ranges):
    assert check_directory(ranges / "images") == 6


def test_other_units_are_those_of_host_sim(ranges):
    """0.2 mm to the unit, as TUM's images have: the same heads, of a slice too."""
    assert check_directory(ranges / "fifths") == 6
    rig = isohead.load_rig(ranges / "fifths" / "rig.json")
    fifth_rig = isohead.depth_rig(WIDTH, HEIGHT, FOCAL, FOCAL, (WIDTH - 1) / 2, (HEIGHT - 1) / 2, depth_scale=0.2)
    assert rig == fifth_rig and abs(rig.depth_scale - 0.2) < 1e-6
    depth = depth_of(0)
    wide = np.zeros((HEIGHT, WIDTH + 50), np.uint16)
    view = wide[:, 20:-30]
    view[:] = 5 * depth
    expected = process(isohead.parse_rig(RANGE_RIG), depth)
    assert expected.hypotheses and process(rig, view) == process(rig, 5 * depth) == expected


def test_lists_are_those_of_host_sim(ranges):
    assert check_directory(ranges / "lists", ".xyz") == 6


@pytest.fixture(name="image", scope="module")
def read_image():
    return read_pgm(FRAMES / "sequence1" / "000020.pgm")


@pytest.fixture(name="rig", scope="module")
def read_rig():
    return isohead.load_rig(FRAMES / "sequence1" / "rig.json")


def process(rig, image, **options):
    return isohead.Detector(rig).process(image, time_us=0, **options)


def test_types_and_strides_give_the_same(rig, image):
    expected = process(rig, image)
    assert expected.head
    wide = np.full((image.shape[0] + 5, image.shape[1] + 32), 255, np.uint8)
    inside = wide[3:-2, 20:-12]
    inside[:] = image
    for same in (inside, memoryview(image), image.astype(np.uint16) * 257, np.asfortranarray(image).copy("C")):
        assert process(rig, same) == expected
    ten_bits = process(rig, image.astype(np.uint16) * 4, maximum=1020)
    assert ten_bits.head and ten_bits.labelled == expected.labelled
    frozen = image.copy()
    frozen.flags.writeable = False
    assert process(rig, frozen) == expected


def test_ambient_is_used(rig, image):
    assert process(rig, image, ambient=image).dots == 0
    flat = np.full_like(image, 30)
    assert process(rig, image, ambient=flat) == process(rig, image)
    with pytest.raises(isohead.Error, match="100x100 px, expected 752x582 as in the rig"):
        process(rig, image, ambient=flat[:100, :100])


def test_an_ambient_of_another_type_is_refused(rig, image):
    wide = image.astype(np.uint16) * 257
    for one, other, bits in ((image, wide, "16 bits, expected 8"), (wide, image, "8 bits, expected 16")):
        with pytest.raises(isohead.Error, match="ambient: samples of " + bits):
            process(rig, one, ambient=other)
    assert process(rig, wide, ambient=wide).dots == 0


def test_a_maximum_that_the_type_cannot_hold_is_refused(rig, image):
    wide = image.astype(np.uint16) * 4
    for picture, maximum, text in ((image, 300, "at most 255"), (image, -1, "at least 0"), (wide, 65536, "at most 65535")):
        with pytest.raises(isohead.Error, match="maximum: %d, expected %s" % (maximum, text)):
            process(rig, picture, maximum=maximum)
    assert process(rig, image, maximum=255) == process(rig, image)


def test_a_unit_that_no_rig_may_have_is_refused(rig):
    depth_rig = isohead.parse_rig(RANGE_RIG)
    for scale in (0, -1, 1e-9, 1001, 1e300, float("nan"), float("inf")):
        for blob in (rig.blob, depth_rig.blob):
            with pytest.raises(isohead.Error, match="depth_scale: .*, expected 0.01 to 1000 mm per unit"):
                isohead.Detector(isohead.Rig(blob, scale))
    isohead.Detector(isohead.Rig(depth_rig.blob, np.float32(0.2)))


def test_numbers_of_numpy_make_a_depth_rig():
    numbers = (WIDTH, HEIGHT, FOCAL, FOCAL, (WIDTH - 1) / 2, (HEIGHT - 1) / 2)
    expected = isohead.depth_rig(*numbers, depth_scale=0.25)
    for kind in (np.float32, np.float64, np.array):
        assert expected == isohead.depth_rig(np.int64(WIDTH), np.uint16(HEIGHT), *map(kind, numbers[2:]),
                                             distortion=np.zeros(5, np.float32), near_mm=np.int32(400),
                                             far_mm=kind(4000), depth_scale=kind(0.25), up=np.array([0, -1, 0]))


@pytest.mark.parametrize("wrong", [float("nan"), np.float32("inf"), "400", None, pytest.param(10**400, id="huge"),
                                   np.zeros(2)])
def test_what_is_no_finite_number_makes_no_depth_rig(wrong):
    names = ("width", "height", "fx", "fy", "cx", "cy")
    numbers = dict(zip(names, (WIDTH, HEIGHT, FOCAL, FOCAL, 160, 120)))
    for name in (*names, "near_mm", "far_mm", "depth_scale"):
        with pytest.raises(isohead.Error, match=r"^%s: [^:]*, expected a finite number" % name):
            isohead.depth_rig(**{**numbers, name: wrong})
    for name, values in (("up", [0, wrong, 0]), ("distortion", [wrong, 0, 0, 0, 0])):
        with pytest.raises(isohead.Error, match="^%s: .*, expected a finite number" % name):
            isohead.depth_rig(**numbers, **{name: values})
    with pytest.raises(isohead.Error, match="image_width: 320.5, expected a whole number"):
        isohead.depth_rig(**{**numbers, "width": 320.5})
    with pytest.raises(isohead.Error, match="up: .0, 0, 0., expected a unit vector"):
        isohead.depth_rig(**numbers, up=(0, 0, 0))


def test_a_record_of_a_name_with_a_zero_is_refused(rig, image):
    detector = isohead.Detector(rig)
    detector.process(image, time_us=0)
    with pytest.raises(isohead.Error, match="file: a zero character"):
        detector.record("a\0b")
    assert json.loads(detector.record("a"))["file"] == "a"


def test_nothing_is_copied(rig, image):
    """NumPy's and Python's own memory of a call stays far below an image's, whatever its strides."""
    detector = isohead.Detector(rig)
    wide = np.zeros((image.shape[0], 2 * image.shape[1]), np.uint8)
    view = wide[:, 100:100 + image.shape[1]]
    view[:] = image
    detector.process(view, time_us=0)
    tracemalloc.start()
    result = detector.process(view, time_us=40000)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert result.head and peak < image.nbytes / 4
    # It is looked at where it is: what is written there shows in the next frame.
    view[:] = 0
    assert detector.process(view, time_us=80000).dots == 0


def test_a_call_keeps_no_image_and_leaks_none(rig, image):
    detector = isohead.Detector(rig)
    own = image.copy()
    count = sys.getrefcount(own)
    for index in range(20):
        detector.process(own, time_us=40000 * index)
        with pytest.raises(isohead.Error):
            detector.process(own, ambient=own[:10], time_us=40000 * index)
    assert sys.getrefcount(own) == count
    own.resize((10, 10), refcheck=False)  # no buffer is exported any more


WRONG_IMAGES = [
    (lambda i: i[:, :, None].repeat(3, 2), isohead.Error, "image: 3 dimensions, expected 2"),
    (lambda i: i.astype(np.float32), isohead.Error, "image: samples of type 'f', expected uint8 or uint16"),
    (lambda i: i.astype(">u2" if sys.byteorder == "little" else "<u2"), isohead.Error, "byte order"),
    (lambda i: i[:, ::-1], isohead.Error, "numpy.ascontiguousarray"),
    (lambda i: i[::-1], isohead.Error, "numpy.ascontiguousarray"),
    (np.asfortranarray, isohead.Error, "numpy.ascontiguousarray"),
    (lambda i: np.frombuffer(b"\0" + i.astype(np.uint16).tobytes(), np.uint8)[1:].view(np.uint16).reshape(i.shape),
     isohead.Error, "numpy.ascontiguousarray"),
    (lambda i: i[:-1], isohead.Error, "752x581 px, expected 752x582 as in the rig"),
    (lambda i: i[:0], isohead.Error, "752x0 px, expected 752x582"),
    (lambda i: i.tobytes(), isohead.Error, "image: 1 dimensions"),
    (lambda i: i.tolist(), TypeError, "image: <class 'list'>, expected a NumPy array"),
    (lambda i: None, TypeError, "NoneType"),
]


@pytest.mark.parametrize("make, kind, text", WRONG_IMAGES)
def test_wrong_images_are_refused(rig, image, make, kind, text):
    detector = isohead.Detector(rig)
    before = detector.process(image, time_us=0)
    with pytest.raises(kind, match=text):
        detector.process(make(image), time_us=1)
    assert detector.process(image, time_us=0).dots == before.dots


def test_a_range_rig_needs_two_bytes_and_points_a_range_rig(rig):
    depth_rig = isohead.parse_rig(RANGE_RIG)
    depth = depth_of(0)
    with pytest.raises(isohead.Error, match="two bytes per pixel"):
        process(depth_rig, depth.astype(np.uint8))
    detector = isohead.Detector(depth_rig)
    for points, text in ((np.zeros((4, 2)), "N rows"), (np.zeros((4, 3), int), "float32"), (np.zeros(3), "N rows"),
                         (np.full((1, 3), 9e6), r"points\[0\]\[0\]: beyond"), (-np.ones((5, 3)), "none of 5 points")):
        with pytest.raises(isohead.Error, match=text):
            detector.process_points(points, time_us=0)
    with pytest.raises(isohead.Error, match="of another kind than the rig"):
        isohead.Detector(rig).process_points(np.ones((4, 3)), time_us=0)
    # Holes, as organised clouds have them, are left out.
    z = depth[::4, ::4].astype(np.float32)
    v, u = np.mgrid[:HEIGHT:4, :WIDTH:4]
    points = np.stack([(u - 159.5) / FOCAL * z, (v - 119.5) / FOCAL * z, z], -1).reshape(-1, 3).astype(np.float32)
    whole = detector.process_points(points, time_us=0)
    holes = np.concatenate([points, np.full((7, 3), np.nan, np.float32)])
    assert whole.points > 100 and isohead.Detector(depth_rig).process_points(holes, time_us=0) == whole


def test_rigs(rig, tmp_path):
    assert (rig.kind, rig.size, rig.range_mm) == ("dots", (752, 582), (400, 2600))
    file = json.loads((FRAMES / "sequence1" / "rig.json").read_text(encoding="utf-8"))
    assert np.allclose(np.ravel(rig.camera_matrix), file["camera_matrix"]["data"], atol=1e-5)
    assert np.allclose(rig.distortion, file["distortion_coefficients"]["data"], atol=1e-7)
    assert isohead.parse_rig(file) == isohead.parse_rig(json.dumps(file)) == rig
    depth_rig = isohead.depth_rig(WIDTH, HEIGHT, FOCAL, FOCAL, (WIDTH - 1) / 2, (HEIGHT - 1) / 2)
    assert depth_rig == isohead.parse_rig(RANGE_RIG) and "range 320x240, 400 to 4000 mm" in repr(depth_rig)
    up = (0, -np.cos(0.5), -np.sin(0.5))
    leaning = isohead.depth_rig(WIDTH, HEIGHT, FOCAL, FOCAL, 160, 120, up=up)
    assert rig.up == depth_rig.up == (0, -1, 0) and np.allclose(leaning.up, up, atol=1e-8)
    # A file is refused with host_sim's words.
    for name, change in (("no_size", {"image_width": None}), ("focal", {"near_mm": 5000, "far_mm": 100}),
                         ("text", {"near_mm": "400"})):
        wrong = tmp_path / name
        wrong.mkdir()
        path = wrong / "rig.json"
        path.write_text(json.dumps({**file, **change}), encoding="utf-8")
        said = subprocess.run([HOST_SIM, "--json", wrong], stderr=subprocess.PIPE, text=True, check=False).stderr
        with pytest.raises(isohead.Error) as caught:
            isohead.load_rig(path)
        assert str(caught.value).split(": ", 1)[1] in said
        with pytest.raises(isohead.Error):
            isohead.parse_rig({**file, **change})
    for path in (tmp_path / "none.json", tmp_path):
        with pytest.raises(isohead.Error, match=str(path)):
            isohead.load_rig(path)
    for text in ("", "[]", "{", "{}", "\0"):
        with pytest.raises(isohead.Error):
            isohead.parse_rig(text)
    with pytest.raises(isohead.Error):
        isohead.Detector(isohead.Rig(rig.blob[:-1] + b"\0" if rig.blob[-1] else rig.blob[:-1] + b"\1"))
    with pytest.raises(isohead.Error):
        isohead.Detector(isohead.Rig(b""))
    with pytest.raises(isohead.Error, match="depth_scale"):
        isohead.depth_rig(WIDTH, HEIGHT, FOCAL, FOCAL, 160, 120, depth_scale=0)
    assert issubclass(isohead.Error, ValueError)


def test_points_are_where_the_head_is(rig, image):
    detector = isohead.Detector(rig)
    assert np.isnan(np.asarray(detector.points_mm())).any()  # before the first frame
    result = detector.process(image, time_us=0)
    points = np.asarray(detector.points_mm())
    assert points.shape == (19, 19, 3) and np.isfinite(points[..., 2]).sum() <= result.labelled
    distance = np.linalg.norm(points - result.head.centre_mm, axis=-1)
    assert (distance[np.isfinite(distance)] < 130).sum() > 12  # as many as a head has at least


def test_one_thread_at_a_time(rig, image):
    """Threads with a detector each work side by side; in one detector the second is refused, never a crash."""
    expected = process(rig, image)
    detector, refused, wrong = isohead.Detector(rig), [], []

    def use(own):
        for index in range(20):
            try:
                own.process(image, time_us=40000 * index)
            except RuntimeError as error:
                refused.append(str(error))
        if isohead.Detector(rig).process(image, time_us=0) != expected:
            wrong.append(own)

    threads = [threading.Thread(target=use, args=(detector,)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong and all("another thread" in text for text in refused)


def test_examples(tmp_path, monkeypatch):
    """draw.py writes a picture with the head in it; depth_camera.py prints a head for each depth image."""
    cv2 = pytest.importorskip("cv2")

    def run(name, *arguments):
        said = io.StringIO()
        monkeypatch.setattr(sys, "argv", [name, *map(str, arguments)])
        monkeypatch.setattr(sys, "stdout", said)
        runpy.run_path(str(PYTHON / "examples" / name), run_name="__main__")
        return said.getvalue()

    picture = tmp_path / "drawn.png"
    run("draw.py", FRAMES / "sequence1" / "rig.json", FRAMES / "sequence1" / "000020.pgm", picture)
    drawn = cv2.imread(str(picture))
    assert drawn.shape == (582, 752, 3) and (drawn.max(2) - drawn.min(2) > 100).sum() > 500  # what is drawn has colour
    for index in range(3):
        # as TUM has them: 5 to the millimetre
        cv2.imwrite(str(tmp_path / ("%d.png" % index)), depth_of(index) * 5)
    images = [tmp_path / ("%d.png" % index) for index in range(3)]
    said = run("depth_camera.py", "--images", FOCAL, FOCAL, 159.5, 119.5, "--unit-mm", 0.2, *images)
    assert len(said.splitlines()) == 3 and said.count(" mm from the camera") == 3
