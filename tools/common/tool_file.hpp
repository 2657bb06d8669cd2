/* tool_file - a file that is written whole or not at all, unless it is killed: one of that name stays as it was until then. A
 * link stays a link, and a file's rights stay; what is no file is not written.
 */
#ifndef TOOL_FILE_HPP
#define TOOL_FILE_HPP

#include <string>

namespace tool
{
/* Written as PATH.NUMBER.part first, the process' number: that is left of it when it is killed. Throws tool::Error, which
 * says why; then nothing is left. */
void file_write(const std::string &path, const std::string &bytes);
} // namespace tool

#endif
