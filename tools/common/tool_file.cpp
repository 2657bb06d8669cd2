#include "tool_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <unistd.h>

#include "tool_error.hpp"

namespace tool
{
/* Where the bytes go: where a link leads to, so that it stays one. */
static std::string file_of(const std::string &path)
{
    std::error_code unknown, failed; /* unknown: of a path that is not there */
    if (!std::filesystem::is_symlink(path, unknown))
        return path;
    std::string file = std::filesystem::canonical(path, failed);
    if (failed)
        throw Error(path + ": could not be written: " + failed.message());
    return file;
}

/* False: errno says why. */
static bool put(int descriptor, const std::string &bytes)
{
    for (size_t done = 0; done < bytes.size();) {
        ssize_t count = write(descriptor, bytes.data() + done, bytes.size() - done);
        if (count < 0)
            return false;
        done += static_cast<size_t>(count);
    }
    return true;
}

void file_write(const std::string &path, const std::string &bytes)
{
    struct stat there = {};
    bool exists = stat(path.c_str(), &there) == 0;
    if (exists && !S_ISREG(there.st_mode))
        throw Error(path +
                    ": could not be written: it is a directory, device or pipe, expected a file");
    std::string file = file_of(path), part = file + "." + std::to_string(getpid()) + ".part";
    unlink(part.c_str()); /* of a process that was killed and had our number */
    int descriptor = open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (descriptor < 0)
        throw Error(path + ": could not be written: " + std::strerror(errno));
    /* On the disk before it has the name: a power cut leaves the old file or this one. */
    bool good = (!exists || fchmod(descriptor, there.st_mode & 0777) == 0) &&
                put(descriptor, bytes) && fsync(descriptor) == 0;
    int reason = errno;
    if (close(descriptor) != 0 && good) {
        good = false;
        reason = errno;
    }
    if (good && std::rename(part.c_str(), file.c_str()) != 0) {
        good = false;
        reason = errno;
    }
    if (!good) {
        unlink(part.c_str());
        throw Error(path + ": could not be written: " + std::strerror(reason));
    }
}
} // namespace tool
