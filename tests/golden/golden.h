/* golden - the core over a fixed set of frames, a hash of every stage's output after every frame.
 *
 * In:    a file that golden_pack wrote (golden_file.h): rigs and recorded frames; for each of them
 *        the made-up frames of golden_scene follow, and a depth camera with its own at the end.
 * Out:   text, one line per frame and stage: "SET FRAME STAGE HASH". Every processor and compiler
 *        must write the same bytes.
 * Needs: no C library but memcpy and its kin, so that it runs where nothing else does. What it is
 *        built into gives it the two functions at the end.
 */
#ifndef GOLDEN_H
#define GOLDEN_H

#include <stdbool.h>
#include <stddef.h>

/* True: all frames were hashed. False: a line "golden: ..." has said why not. */
bool golden_run(void);

/* The next size bytes of the file; false when there are fewer. */
bool golden_read(void *data, size_t size);

/* Append to the output; false when it cannot be written. */
bool golden_write(const char *text, size_t size);

#endif
