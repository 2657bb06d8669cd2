#include "tool_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "tool_error.hpp"

namespace tool
{
void file_write(const std::string &path, const std::string &bytes)
{
    std::string other = path + ".part";
    std::ofstream file(other, std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file || std::rename(other.c_str(), path.c_str()) != 0) {
        std::string reason = std::strerror(errno);
        std::remove(other.c_str());
        throw Error(path + ": could not be written: " + reason);
    }
}
} // namespace tool
