/* fuzz_file - files in memory for parsers that take a path, and a directory of them.
 *
 * A file is rewritten in place, which costs two system calls and no disk. Where something fails the
 * process ends: it is the machine's fault, not the input's.
 */
#ifndef FUZZ_FILE_H
#define FUZZ_FILE_H

#include "fuzz.h"

/* The path of a regular file with these bytes, until the next call. */
const char *fuzz_file_path(const uint8_t *bytes, size_t size);

/* The path of a directory below TMPDIR that is removed when the process ends, the same at each call.
 * Only fuzz_file_write puts something into it: links to files in memory. */
const char *fuzz_file_directory(void);

/* Write a file of that directory anew. At most FUZZ_FILES_MAX names in all, each a string constant. */
#define FUZZ_FILES_MAX 8
void fuzz_file_write(const char *name, const uint8_t *bytes, size_t size);

#endif
