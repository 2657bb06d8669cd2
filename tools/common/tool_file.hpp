/* tool_file - a file that is written whole or not at all: one of that name stays as it was until then.
 */
#ifndef TOOL_FILE_HPP
#define TOOL_FILE_HPP

#include <string>

namespace tool
{
/* Written as PATH.part first. Throws tool::Error, which says why; then nothing is left of it. */
void file_write(const std::string &path, const std::string &bytes);
} // namespace tool

#endif
