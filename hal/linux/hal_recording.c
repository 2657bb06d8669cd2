#include "linux/hal_recording.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "hal_file.h"

#define DIR_MODE 0777
#define FILE_MODE 0666
#define LIST "frames.jsonl"
#define LINE_MAX_BYTES 160
#define HEAD_MAX_BYTES 64

struct path {
    char text[HAL_RECORDING_PATH_MAX + 2 * HAL_RECORDING_NAME_MAX];
};

static struct path path_in(const char *dir, const char *before, const char *name, const char *after)
{
    struct path path;
    snprintf(path.text, sizeof path.text, "%s/%s%s%s", dir, before, name, after);
    return path;
}

static bool fail(struct hal_error *error, const char *doing, const char *path)
{
    return hal_fail(error, "%s %.160s: %s", doing, path, strerror(errno));
}

/* The next file or folder; NULL at the end. */
static const struct dirent *next_item(DIR *dir, struct stat *about)
{
    const struct dirent *item = NULL;
    while ((item = readdir(dir)) != NULL) {
        if (strcmp(item->d_name, ".") != 0 && strcmp(item->d_name, "..") != 0 &&
            fstatat(dirfd(dir), item->d_name, about, AT_SYMLINK_NOFOLLOW) == 0) {
            return item;
        }
    }
    return NULL;
}

/* Of all files of a part. */
static int64_t bytes_of_part(int parent_fd, const char *name)
{
    struct stat about;
    int64_t bytes = 0;
    int fd = openat(parent_fd, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    DIR *dir = fd >= 0 ? fdopendir(fd) : NULL;
    while (dir != NULL && next_item(dir, &about) != NULL) {
        bytes += S_ISREG(about.st_mode) ? about.st_size : 0;
    }
    if (dir != NULL) {
        closedir(dir);
    } else if (fd >= 0) {
        close(fd);
    }
    return bytes;
}

/* On a board of 32 bits a file ends at 2 GB. */
static bool write_all(int fd, const void *content, size_t size, int64_t offset)
{
    const char *at = content;
    while (size > 0) {
        ssize_t count = pwrite(fd, at, size, (off_t)offset);
        if (count < 0 && errno == EINTR) {
            continue;
        }
        if (count <= 0) {
            errno = count == 0 ? ENOSPC : errno;
            return false;
        }
        at += count;
        offset += count;
        size -= (size_t)count;
    }
    return true;
}

/* A whole new file of two pieces, or none. */
static bool write_file(const char *path, const void *head, size_t head_size, const void *content,
                       size_t size, struct hal_error *error)
{
    int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, FILE_MODE);
    if (fd < 0) {
        return fail(error, "making", path);
    }
    bool good =
        write_all(fd, head, head_size, 0) && write_all(fd, content, size, (int64_t)head_size);
    good = good || fail(error, "writing", path);
    if (close(fd) != 0 && good) {
        good = fail(error, "writing", path);
    }
    if (!good) {
        unlink(path);
    }
    return good;
}

static void close_part(struct hal_recording *recording)
{
    if (recording->list_fd >= 0) {
        syncfs(recording->list_fd);
        close(recording->list_fd);
    }
    recording->list_fd = -1;
    recording->part = 0;
}

/* Counts what is there; *number_max: the last part. */
static bool look_into(struct hal_recording *recording, long *number_max, struct hal_error *error)
{
    const struct dirent *item = NULL;
    struct stat about;
    DIR *dir = opendir(recording->config.dir);
    if (dir == NULL) {
        return fail(error, "opening", recording->config.dir);
    }
    *number_max = 0;
    recording->bytes = 0;
    while ((item = next_item(dir, &about)) != NULL) {
        if (S_ISDIR(about.st_mode)) {
            long number = strtol(item->d_name, NULL, 10);
            *number_max = number > *number_max ? number : *number_max;
            recording->bytes += bytes_of_part(dirfd(dir), item->d_name);
        } else if (S_ISREG(about.st_mode)) {
            recording->bytes += about.st_size;
        }
    }
    closedir(dir);
    return true;
}

static bool make_part_dir(struct hal_recording *recording, struct hal_error *error)
{
    long number = 0;
    if (!look_into(recording, &number, error)) {
        return false;
    }
    snprintf(recording->part_dir, sizeof recording->part_dir, "%s/%06ld", recording->config.dir,
             number + 1);
    return mkdir(recording->part_dir, DIR_MODE) == 0 || fail(error, "making", recording->part_dir);
}

/* What goes with the frames comes first: whatever is cut off later can be read. */
static bool fill_part_dir(struct hal_recording *recording, struct hal_error *error)
{
    const char *dir = recording->part_dir;
    const char *settings = recording->config.settings;
    struct path list = path_in(dir, "", LIST, "");
    if (!write_file(path_in(dir, "", "rig.json", "").text, "", 0, recording->rig_text,
                    recording->rig_size, error) ||
        !write_file(path_in(dir, "", "settings.json", "").text, "", 0, settings, strlen(settings),
                    error)) {
        return false;
    }
    recording->list_fd = open(list.text, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, FILE_MODE);
    if (recording->list_fd < 0) {
        return fail(error, "making", list.text);
    }
    recording->bytes += (int64_t)(recording->rig_size + strlen(settings));
    recording->list_bytes = 0;
    return true;
}

static bool begin_part(struct hal_recording *recording, const struct hal_recording_frame *frame,
                       struct hal_error *error)
{
    static const char *const names[] = {"rig.json", "settings.json", LIST};
    close_part(recording);
    if (!make_part_dir(recording, error)) {
        return false;
    }
    if (!fill_part_dir(recording, error)) {
        for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
            unlink(path_in(recording->part_dir, "", names[i], "").text);
        }
        rmdir(recording->part_dir);
        return false;
    }
    recording->part = frame->part;
    recording->name_length = strlen(frame->name);
    return true;
}

/* Netpbm has the most significant byte first. */
static void order_bytes(uint8_t *samples, size_t size)
{
    const uint16_t one = 1;
    if (*(const uint8_t *)&one == 0) {
        return;
    }
    for (size_t i = 0; i + 1 < size; i += 2) {
        uint8_t low = samples[i];
        samples[i] = samples[i + 1];
        samples[i + 1] = low;
    }
}

static bool add_line(struct hal_recording *recording, const char *line, size_t size,
                     struct hal_error *error)
{
    if (write_all(recording->list_fd, line, size, recording->list_bytes)) {
        recording->list_bytes += (int64_t)size;
        return true;
    }
    fail(error, "writing", LIST);
    if (ftruncate(recording->list_fd, (off_t)recording->list_bytes) != 0) {
        close_part(recording); /* the next frame begins another */
    }
    return false;
}

bool hal_recording_put(struct hal_recording *recording, const struct hal_recording_frame *frame,
                       uint8_t *samples, struct hal_error *error)
{
    char head[HEAD_MAX_BYTES], line[LINE_MAX_BYTES];
    const size_t size =
        (size_t)frame->width * (size_t)frame->height * (size_t)frame->bytes_per_sample;
    const int head_size = snprintf(head, sizeof head, "P5\n%d %d\n%d\n", (int)frame->width,
                                   (int)frame->height, (int)frame->maximum);
    const int line_size =
        snprintf(line, sizeof line, "{\"file\":\"%s\",\"time_us\":%lld,\"laser\":%s}\n",
                 frame->name, (long long)frame->time_us, frame->lit ? "true" : "false");
    const int64_t all = (int64_t)size + head_size + line_size;
    if (recording->bytes + all > recording->config.bytes_max) {
        return hal_fail(
            error,
            "%.160s has %lld bytes; with the next frame they would be more than record-max allows",
            recording->config.dir, (long long)recording->bytes);
    }
    if ((recording->part != frame->part || recording->name_length != strlen(frame->name)) &&
        !begin_part(recording, frame, error)) {
        return false;
    }
    const struct path hidden = path_in(recording->part_dir, ".", frame->name, ".part");
    if (frame->bytes_per_sample == 2) {
        order_bytes(samples, size);
    }
    if (!write_file(hidden.text, head, (size_t)head_size, samples, size, error)) {
        return false;
    }
    if (!add_line(recording, line, (size_t)line_size, error)) {
        unlink(hidden.text);
        return false;
    }
    recording->bytes += all;
    const struct path path = path_in(recording->part_dir, "", frame->name, "");
    return rename(hidden.text, path.text) == 0 || fail(error, "naming", path.text);
}

/* A text that begins with its first field, an object of JSON without "up". To be freed by the caller; NULL: no memory. */
static char *insert_up(const char *text, const char *up)
{
    const size_t before = strcspn(text, "{") + 1;
    const size_t size = strlen(text) + strlen(up) + sizeof "\"up\":,";
    char *out = malloc(size);
    if (out != NULL) {
        snprintf(out, size, "%.*s\"up\":%s,%s", (int)before, text, up, text + before);
    }
    return out;
}

/* Does it say which way is up? So does what is no object, in which nothing can be written. */
static bool has_up(const char *text)
{
    cJSON *rig = cJSON_Parse(text);
    bool has = !cJSON_IsObject(rig) || cJSON_GetObjectItemCaseSensitive(rig, "up") != NULL;
    cJSON_Delete(rig);
    return has;
}

bool hal_recording_rig(struct hal_recording *recording, struct hal_error *error)
{
    uint8_t *text = NULL;
    size_t size = 0;
    struct hal_error reason;
    if (!hal_file_read(recording->config.rig, HAL_RECORDING_RIG_MAX, &text, &size, &reason)) {
        return hal_fail(error, "%.100s: %.120s", recording->config.rig, reason.text);
    }
    char *with_up = NULL;
    if (recording->config.up != NULL && !has_up((const char *)text)) {
        with_up = insert_up((const char *)text, recording->config.up);
        free(text);
        if (with_up == NULL) {
            return hal_fail(error, "no memory");
        }
    }
    free(recording->rig_text);
    recording->rig_text = with_up != NULL ? with_up : (char *)text;
    recording->rig_size = with_up != NULL ? strlen(with_up) : size;
    return true;
}

/* What cannot be written is better known before anything has happened. */
static bool try_dir(const char *dir, struct hal_error *error)
{
    const struct path trial = path_in(dir, ".", "isohead", ".part");
    if (mkdir(dir, DIR_MODE) != 0 && errno != EEXIST) {
        return fail(error, "making", dir);
    }
    if (!write_file(trial.text, "", 0, "x", 1, error)) {
        return false;
    }
    unlink(trial.text);
    return true;
}

bool hal_recording_open(struct hal_recording *recording, const struct hal_recording_config *config,
                        struct hal_error *error)
{
    long ignored = 0;
    *recording = (struct hal_recording){.config = *config, .list_fd = -1};
    if (strlen(config->dir) > HAL_RECORDING_PATH_MAX - HAL_RECORDING_NAME_MAX) {
        return hal_fail(error, "the directory's name has %zu bytes, expected at most %d",
                        strlen(config->dir), HAL_RECORDING_PATH_MAX - HAL_RECORDING_NAME_MAX);
    }
    return try_dir(config->dir, error) && look_into(recording, &ignored, error) &&
           hal_recording_rig(recording, error);
}

void hal_recording_close(struct hal_recording *recording)
{
    close_part(recording);
    free(recording->rig_text);
    recording->rig_text = NULL;
}
