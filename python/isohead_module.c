/* isohead._core - the core for Python, by the stable C interface of Python 3.11 and later.
 *
 * Rigs are blobs (ih_rig_blob.h), results plain tuples: isohead/__init__.py gives them names. Images are buffers that
 * are looked at where they are. Errors are isohead.Error with the texts of host_sim. While a frame is processed other
 * threads of Python run.
 */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "app_record.h"
#include "app_rig.h"
#include "app_rig_text.h"
#include "app_view.h"
#include "isohead.h"
#include "replay/hal_xyz.h"
#include "rig/ih_rig_blob.h"
#include "sim_cloud.h"

#define AXES 3

struct detector {
    PyObject_HEAD struct isohead *head;
    struct sim_cloud cloud;
    int64_t time_us; /* of the last frame */
    bool is_busy;    /* a thread is in it, without Python's lock */
};

static PyObject *error_type; /* isohead.Error */

static void *fail(const char *text)
{
    PyErr_SetString(error_type, text);
    return NULL;
}

/* Always false. */
static bool refuse(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    PyErr_FormatV(error_type, format, arguments);
    va_end(arguments);
    return false;
}

static double from_fixed(int64_t value, int fraction_bits)
{
    return ldexp((double)value, -fraction_bits);
}

static double from_radians(int32_t angle_rad_q30)
{
    return from_fixed(angle_rad_q30, 30) * (180 / 3.14159265358979323846);
}

/* ---- rigs ---- */

/* A calibration that the core accepts, as bytes, and the unit of depths. NULL with an exception whose text begins with the path, if there is one. */
static PyObject *to_blob(const struct ih_calibration *calibration, int32_t scale_q20,
                         const char *path)
{
    uint8_t blob[IH_RIG_BLOB_BYTES];
    struct hal_error error;
    int32_t bad_slot = IH_NONE;
    struct ih_rig *rig = malloc(sizeof *rig);
    if (rig == NULL) {
        return PyErr_NoMemory();
    }
    enum ih_err err = ih_rig_init(rig, calibration, &bad_slot);
    free(rig);
    if (err != IH_OK) {
        app_rig_explain(calibration, err, bad_slot, &error);
        return PyErr_Format(error_type, path != NULL ? "%s: %s" : "%s%s", path != NULL ? path : "",
                            error.text);
    }
    err = app_rig_to_blob(calibration, blob);
    return err == IH_OK
               ? Py_BuildValue("y#i", (const char *)blob, (Py_ssize_t)sizeof blob, (int)scale_q20)
               : fail(ih_err_text(err));
}

static PyObject *load_rig(PyObject *module, PyObject *argument)
{
    struct ih_calibration calibration;
    struct hal_error error;
    int32_t scale_q20 = APP_RIG_SCALE_ONE;
    PyObject *path = NULL;
    (void)module;
    if (!PyUnicode_FSConverter(argument, &path)) {
        return NULL;
    }
    PyObject *blob = NULL;
    const char *name = PyBytes_AsString(path);
    if (app_rig_load_scaled(name, &calibration, &scale_q20, &error)) {
        blob = to_blob(&calibration, scale_q20, name);
    } else {
        PyErr_Format(error_type, "%s: %s", name, error.text);
    }
    Py_DECREF(path);
    return blob;
}

static PyObject *parse_rig(PyObject *module, PyObject *argument)
{
    struct ih_calibration calibration;
    struct hal_error error;
    int32_t scale_q20 = APP_RIG_SCALE_ONE;
    Py_ssize_t size = 0;
    (void)module;
    const char *text = PyUnicode_AsUTF8AndSize(argument, &size);
    if (text == NULL) {
        return NULL;
    }
    if (!app_rig_parse(text, (size_t)size, &calibration, &scale_q20, &error)) {
        return fail(error.text);
    }
    return to_blob(&calibration, scale_q20, NULL);
}

static bool decode(const char *bytes, Py_ssize_t size, struct ih_calibration *calibration)
{
    enum ih_err err = ih_rig_blob_decode((const uint8_t *)bytes, (size_t)size, calibration);
    if (err != IH_OK) {
        (void)fail(ih_err_text(err));
    }
    return err == IH_OK;
}

/* ---- images and points as Python has them ---- */

/* The type of a buffer's elements as one letter, 0 for what is not of the processor's own byte order. */
static char type_of(const Py_buffer *buffer)
{
    const uint16_t one = 1;
    const char own = *(const char *)&one == 1 ? '<' : '>';
    const char *format = buffer->format != NULL ? buffer->format : "B";
    if (*format == '@' || *format == '=' || *format == own) {
        format++;
    }
    return format[0] != 0 && format[1] == 0 ? format[0] : (char)0;
}

static bool check_image(const Py_buffer *buffer, const char *what)
{
    if (buffer->ndim != 2) {
        return refuse("%s: %d dimensions, expected 2: rows and columns of grey values or depths",
                      what, buffer->ndim);
    }
    const char type = type_of(buffer);
    if (type != 'B' && type != 'H') {
        return refuse(
            "%s: samples of type '%s', expected uint8 or uint16 of this processor's byte order",
            what, buffer->format != NULL ? buffer->format : "");
    }
    const Py_ssize_t stride = buffer->strides[0], row = buffer->shape[1] * buffer->itemsize;
    const bool is_odd =
        buffer->itemsize == 2 && ((uintptr_t)buffer->buf % 2 != 0 || stride % 2 != 0);
    if (buffer->strides[1] != buffer->itemsize || stride < row || stride > INT32_MAX || is_odd) {
        return refuse(
            "%s: strides of %zd and %zd bytes, expected adjacent pixels and the top row first: "
            "numpy.ascontiguousarray makes such a copy",
            what, stride, buffer->strides[1]);
    }
    return true;
}

/* A view of an image. False with an exception; else the buffer is to be released. */
static bool open_image(PyObject *image, const char *what, int maximum, Py_buffer *buffer,
                       struct hal_frame *frame)
{
    if (PyObject_GetBuffer(image, buffer, PyBUF_STRIDED_RO | PyBUF_FORMAT) != 0) {
        PyErr_Clear();
        PyErr_Format(PyExc_TypeError,
                     "%s: %R, expected a NumPy array or another buffer of uint8 or uint16", what,
                     (PyObject *)Py_TYPE(image));
        return false;
    }
    if (!check_image(buffer, what)) {
        PyBuffer_Release(buffer);
        return false;
    }
    const int32_t full_scale = buffer->itemsize == 1 ? UINT8_MAX : UINT16_MAX;
    if (maximum < 0 || maximum > full_scale) {
        PyBuffer_Release(buffer);
        return refuse("maximum: %d, expected at %s %d", maximum, maximum < 0 ? "least" : "most",
                      maximum < 0 ? 0 : (int)full_scale);
    }
    *frame = (struct hal_frame){
        .samples = buffer->buf,
        .width = (int32_t)buffer->shape[1],
        .height = buffer->shape[0] < INT32_MAX ? (int32_t)buffer->shape[0] : INT32_MAX,
        .stride_bytes = (int32_t)buffer->strides[0],
        .bytes_per_sample = (int32_t)buffer->itemsize,
        .maximum = maximum > 0 ? maximum : full_scale,
    };
    return true;
}

/* The same of the picture without laser, which is of the image's type. */
static bool open_ambient(PyObject *ambient, const struct hal_frame *image, Py_buffer *buffer,
                         struct hal_frame *frame)
{
    if (!open_image(ambient, "ambient", 0, buffer, frame)) {
        return false;
    }
    if (frame->bytes_per_sample != image->bytes_per_sample) {
        PyBuffer_Release(buffer);
        return refuse("ambient: samples of %d bits, expected %d as in the image",
                      (int)frame->bytes_per_sample * 8, (int)image->bytes_per_sample * 8);
    }
    frame->maximum = image->maximum;
    return true;
}

/* Wherever it lies: a buffer need not be aligned. */
static double number_at(const Py_buffer *buffer, char type, Py_ssize_t index)
{
    double wide = 0;
    float narrow = 0;
    const char *at = (const char *)buffer->buf + index * buffer->itemsize;
    if (type == 'd') {
        memcpy(&wide, at, sizeof wide);
        return wide;
    }
    memcpy(&narrow, at, sizeof narrow);
    return (double)narrow;
}

/* The points of N x 3 numbers that are finite, in new memory. NULL with an exception. */
static int32_t (*read_points(const Py_buffer *buffer, int32_t *count))[AXES]
{
    const char type = type_of(buffer);
    if (buffer->ndim != 2 || buffer->shape[1] != AXES || (type != 'd' && type != 'f') ||
        buffer->shape[0] > INT32_MAX) {
        return fail("points: expected N rows of x, y, z in mm, float32 or float64");
    }
    int32_t(*point_mm_q8)[AXES] = malloc(((size_t)buffer->shape[0] + 1) * sizeof *point_mm_q8);
    if (point_mm_q8 == NULL) {
        return (int32_t(*)[AXES])PyErr_NoMemory();
    }
    *count = 0;
    for (Py_ssize_t i = 0; i < buffer->shape[0]; i++) {
        bool is_finite = true;
        for (Py_ssize_t axis = 0; axis < AXES; axis++) {
            const Py_ssize_t at = i * AXES + axis;
            const double mm = number_at(buffer, type, at);
            if (fabs(mm) > HAL_XYZ_MAX_MM && isfinite(mm)) {
                free(point_mm_q8);
                PyErr_Format(error_type, "points[%zd][%zd]: beyond +-%d mm", i, axis,
                             HAL_XYZ_MAX_MM);
                return NULL;
            }
            is_finite = is_finite && isfinite(mm);
            point_mm_q8[*count][axis] = isfinite(mm) ? (int32_t)lround(mm * 256) : 0;
        }
        *count += is_finite;
    }
    return point_mm_q8;
}

/* ---- results ---- */

/* Takes over value, which may be NULL after an error. */
static bool append(PyObject *list, PyObject *value)
{
    const bool good = value != NULL && PyList_Append(list, value) == 0;
    Py_XDECREF(value);
    return good;
}

static PyObject *number_or_none(bool is_known, double value)
{
    if (!is_known) {
        Py_RETURN_NONE;
    }
    return PyFloat_FromDouble(value);
}

static PyObject *index_or_none(int32_t index, int32_t none)
{
    if (index == none) {
        Py_RETURN_NONE;
    }
    return PyLong_FromLong(index);
}

static PyObject *make_hypothesis(const struct ih_result_entry *h)
{
    const int32_t *centre = h->centre_mm_q8;
    return Py_BuildValue(
        "(ddd)(dd)(dd)ddzNNNNN", from_fixed(centre[0], 8), from_fixed(centre[1], 8),
        from_fixed(centre[2], 8), from_fixed(h->u_px_q12, 12), from_fixed(h->v_px_q12, 12),
        from_fixed(h->a_px_q12, 12), from_fixed(h->b_px_q12, 12), h->angle_mdeg / 1000.0,
        from_fixed(h->distance_mm_q8, 8), ih_reject_text(h->rejected),
        number_or_none(h->has_probability, from_fixed(h->probability_q16, 16)),
        number_or_none(h->has_probability && !h->is_predicted,
                       from_fixed(h->frame_probability_q16, 16)),
        index_or_none(h->track_id, 0),
        number_or_none(h->track_id != 0, from_fixed(h->sigma_mm_q8, 8)),
        PyBool_FromLong(h->is_predicted));
}

static PyObject *make_alignment(const struct isohead *head)
{
    const struct ih_alignment *now = &head->align.now;
    const int32_t *rotation = now->rotation_rad_q30, *sigma = now->sigma_rad_q30;
    if (head->rig.calibration.kind == IH_RIG_RANGE || head->params.is_paper) {
        Py_RETURN_NONE;
    }
    return Py_BuildValue(
        "sN(ddd)(ddd)d(dd)N", app_rig_text(now->state),
        number_or_none(now->across_px_q12 >= 0, from_fixed(now->across_px_q12, 12)),
        from_radians(rotation[0]), from_radians(rotation[1]), from_radians(rotation[2]),
        from_radians(sigma[0]), from_radians(sigma[1]), from_radians(sigma[2]),
        from_fixed(now->focal_q30, 30) * 100, from_fixed(now->shift_px_q12[0], 12),
        from_fixed(now->shift_px_q12[1], 12), PyBool_FromLong(now->is_depth_known));
}

/* (hypotheses, indices of heads, of the head, dots, labelled, points, alignment, dropped of each kind) */
static PyObject *make_result(const struct isohead *head)
{
    const struct ih_result *result = &head->result;
    const bool is_range = head->rig.calibration.kind == IH_RIG_RANGE;
    PyObject *hypotheses = PyList_New(0), *heads = PyList_New(0);
    bool good = hypotheses != NULL && heads != NULL;
    for (int32_t i = 0; good && i < result->entry_count; i++) {
        good = append(hypotheses, make_hypothesis(&result->entry[i]));
    }
    for (int32_t i = 0; good && i < result->head_count; i++) {
        good = append(heads, PyLong_FromLong(result->head[i]));
    }
    if (!good) {
        Py_XDECREF(hypotheses);
        Py_XDECREF(heads);
        return NULL;
    }
    return Py_BuildValue(
        "NNNiiNN(iiiiii)", hypotheses, heads, index_or_none(result->selected, IH_NONE),
        (int)head->dots.dot_count, (int)head->labels.labelled_count,
        index_or_none(is_range ? head->points.seen_count : IH_NONE, IH_NONE), make_alignment(head),
        (int)head->dots.dots_dropped, (int)head->labels.candidates_dropped,
        (int)head->nests.minima_dropped, (int)head->nests.contours_dropped,
        (int)head->windows.places_dropped, (int)head->detections.dropped_count);
}

/* ---- the detector ---- */

static PyObject *detector_new(PyTypeObject *type, PyObject *arguments, PyObject *keywords)
{
    struct ih_calibration calibration;
    struct hal_error error;
    const char *bytes = NULL;
    Py_ssize_t size = 0;
    double depth_scale = 1;
    int is_paper = 0;
    int32_t bad_slot = IH_NONE;
    (void)keywords;
    if (!PyArg_ParseTuple(arguments, "y#dp", &bytes, &size, &depth_scale, &is_paper) ||
        !decode(bytes, size, &calibration)) {
        return NULL;
    }
    /* A rig made by hand has passed no check of app_rig. */
    if (!(depth_scale >= APP_RIG_SCALE_MIN && depth_scale <= APP_RIG_SCALE_MAX)) {
        hal_fail(&error, "depth_scale: %g, expected %g to %g mm per unit", depth_scale,
                 APP_RIG_SCALE_MIN, APP_RIG_SCALE_MAX);
        return fail(error.text);
    }
    allocfunc allocate = (allocfunc)PyType_GetSlot(type, Py_tp_alloc);
    struct detector *detector = (struct detector *)allocate(type, 0);
    if (detector == NULL) {
        return NULL;
    }
    detector->head = aligned_alloc(_Alignof(struct isohead), sizeof *detector->head);
    detector->cloud.depth_mm =
        malloc((size_t)calibration.width * (size_t)calibration.height * sizeof(uint16_t));
    if (detector->head == NULL || detector->cloud.depth_mm == NULL) {
        Py_DECREF(detector);
        return PyErr_NoMemory();
    }
    detector->cloud.scale_q20 = (int32_t)lround(depth_scale * APP_RIG_SCALE_ONE);
    memset(detector->head, 0, sizeof *detector->head);
    enum ih_err err = isohead_init(detector->head, &calibration, &bad_slot);
    if (err != IH_OK) {
        app_rig_explain(&calibration, err, bad_slot, &error);
        Py_DECREF(detector);
        return fail(error.text);
    }
    if (is_paper) {
        ih_params_paper(&detector->head->params);
    }
    return (PyObject *)detector;
}

static void detector_free(PyObject *self)
{
    struct detector *detector = (struct detector *)self;
    PyTypeObject *type = Py_TYPE(self);
    freefunc release = (freefunc)PyType_GetSlot(type, Py_tp_free);
    free(detector->head);
    sim_cloud_free(&detector->cloud);
    release(self);
    Py_DECREF(type);
}

/* Nobody else is in it: so is this thread from now on. */
static bool enter(struct detector *detector)
{
    if (detector->is_busy) {
        PyErr_SetString(PyExc_RuntimeError,
                        "another thread uses this detector: give each thread its own");
        return false;
    }
    detector->is_busy = true;
    return true;
}

/* The frame through the core; called with the detector entered, which it leaves. */
static PyObject *process(struct detector *detector, const struct hal_frame *frame,
                         const struct hal_frame *ambient)
{
    struct isohead *head = detector->head;
    struct hal_error error = {""};
    struct ih_frame view, ambient_view;
    Py_BEGIN_ALLOW_THREADS if (ambient != NULL)
    {
        ambient_view = app_view_of(ambient);
    }
    if (sim_cloud_view(&detector->cloud, frame, &head->rig, &view, &error)) {
        enum ih_err err =
            isohead_frame(head, &view, ambient != NULL ? &ambient_view : NULL, frame->time_us);
        if (err != IH_OK && ambient != NULL &&
            (ambient->width != head->rig.calibration.width ||
             ambient->height != head->rig.calibration.height)) {
            frame = ambient;
        }
        if (err != IH_OK) {
            app_view_explain(frame, &head->rig.calibration, err, &error);
        }
    }
    Py_END_ALLOW_THREADS detector->is_busy = false;
    if (error.text[0] != 0) {
        return fail(error.text);
    }
    detector->time_us = frame->time_us;
    return make_result(head);
}

/* frame(image, ambient, time_us, maximum) */
static PyObject *detector_frame(PyObject *self, PyObject *arguments)
{
    struct detector *detector = (struct detector *)self;
    PyObject *image = NULL, *ambient = NULL, *result = NULL;
    long long time_us = 0;
    int maximum = 0;
    Py_buffer buffer, ambient_buffer;
    struct hal_frame frame, ambient_frame;
    if (!PyArg_ParseTuple(arguments, "OOLi", &image, &ambient, &time_us, &maximum) ||
        !open_image(image, "image", maximum, &buffer, &frame)) {
        return NULL;
    }
    const bool has_ambient = ambient != Py_None;
    if (!has_ambient || open_ambient(ambient, &frame, &ambient_buffer, &ambient_frame)) {
        frame.time_us = time_us;
        if (enter(detector)) {
            result = process(detector, &frame, has_ambient ? &ambient_frame : NULL);
        }
        if (has_ambient) {
            PyBuffer_Release(&ambient_buffer);
        }
    }
    PyBuffer_Release(&buffer);
    return result;
}

/* cloud(points, time_us) */
static PyObject *detector_cloud(PyObject *self, PyObject *arguments)
{
    struct detector *detector = (struct detector *)self;
    PyObject *points = NULL, *result = NULL;
    long long time_us = 0;
    Py_buffer buffer;
    int32_t count = 0;
    if (!PyArg_ParseTuple(arguments, "OL", &points, &time_us) ||
        PyObject_GetBuffer(points, &buffer, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) != 0) {
        return NULL;
    }
    int32_t(*point_mm_q8)[AXES] = read_points(&buffer, &count);
    PyBuffer_Release(&buffer);
    if (point_mm_q8 != NULL && enter(detector)) {
        const struct hal_frame frame = {.point_mm_q8 = (const int32_t(*)[AXES])point_mm_q8,
                                        .point_count = count,
                                        .time_us = time_us};
        result = process(detector, &frame, NULL);
    }
    free(point_mm_q8);
    return result;
}

static PyObject *detector_record(PyObject *self, PyObject *name)
{
    struct detector *detector = (struct detector *)self;
    Py_ssize_t size = 0;
    const char *file = PyUnicode_AsUTF8AndSize(name, &size);
    if (file == NULL) {
        return NULL;
    }
    if (strlen(file) != (size_t)size) {
        return fail("file: a zero character in it, expected the name of a frame");
    }
    if (!enter(detector)) {
        return NULL;
    }
    PyObject *text = NULL;
    struct app_record *record = malloc(sizeof *record);
    const struct hal_frame frame = {.name = file, .time_us = detector->time_us};
    if (record == NULL) {
        (void)PyErr_NoMemory();
    } else {
        record->dir = NULL;
        text = app_record_frame(record, &frame, detector->head, NULL)
                   ? PyUnicode_FromStringAndSize(record->text, (Py_ssize_t)record->length - 1)
                   : fail("a record that is too long");
    }
    free(record);
    detector->is_busy = false;
    return text;
}

/* The measured points by slot, mm, three doubles each; not a number where nothing was measured. */
static PyObject *detector_points(PyObject *self, PyObject *none)
{
    struct detector *detector = (struct detector *)self;
    double point_mm[IH_SLOTS][AXES];
    (void)none;
    if (!enter(detector)) {
        return NULL;
    }
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_point *point = &detector->head->points.point[slot];
        const double z =
            point->state == IH_POINT_SEEN ? from_fixed(point->depth_mm_q8, 8) : (double)NAN;
        point_mm[slot][0] = z * from_fixed(point->x_q28, 28);
        point_mm[slot][1] = z * from_fixed(point->y_q28, 28);
        point_mm[slot][2] = z;
    }
    detector->is_busy = false;
    return PyBytes_FromStringAndSize((const char *)point_mm, sizeof point_mm);
}

static PyMethodDef detector_methods[] = {
    {"frame", detector_frame, METH_VARARGS, NULL},
    {"cloud", detector_cloud, METH_VARARGS, NULL},
    {"record", detector_record, METH_O, NULL},
    {"points", detector_points, METH_NOARGS, NULL},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot detector_slots[] = {
    {Py_tp_new, detector_new},
    {Py_tp_dealloc, detector_free},
    {Py_tp_methods, detector_methods},
    {0, NULL},
};

static PyType_Spec detector_spec = {
    .name = "isohead._core.Detector",
    .basicsize = sizeof(struct detector),
    .flags = Py_TPFLAGS_DEFAULT,
    .slots = detector_slots,
};

static PyMethodDef functions[] = {
    {"load_rig", load_rig, METH_O, NULL},
    {"parse_rig", parse_rig, METH_O, NULL},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef definition = {PyModuleDef_HEAD_INIT, .m_name = "isohead._core",
                                        .m_size = -1, .m_methods = functions};

PyMODINIT_FUNC PyInit__core(void);

PyMODINIT_FUNC PyInit__core(void)
{
    PyObject *module = PyModule_Create(&definition);
    if (module == NULL) {
        return NULL;
    }
    PyObject *type = PyType_FromSpec(&detector_spec);
    error_type =
        PyErr_NewExceptionWithDoc("isohead.Error",
                                  "What isohead was given is wrong: the text says what, and what "
                                  "was expected.",
                                  PyExc_ValueError, NULL);
    if (type == NULL || error_type == NULL ||
        PyModule_AddObjectRef(module, "Detector", type) != 0 ||
        PyModule_AddObjectRef(module, "Error", error_type) != 0 ||
        PyModule_AddStringConstant(module, "VERSION", ISOHEAD_VERSION) != 0) {
        Py_CLEAR(module);
    }
    Py_XDECREF(type);
    return module;
}
