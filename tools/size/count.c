/* count - a plugin for QEMU: how often each piece of code ran, and how deep the stack went.
 *
 *     -plugin libcount.so,out=FILE,stack=ADDRESS,mark=ADDRESS,mark=ADDRESS...
 *
 * A phase begins where the code at a mark is reached, and ends where the next one does. FILE gets of every
 * phase "phase MARK FIRST LOWEST", the stack's first and lowest store in it (at ADDRESS or above), and a
 * line "ADDRESS INSTRUCTIONS RUNS" for every piece of code in it. Numbers are hexadecimal.
 *
 * A piece is one of QEMU's translation blocks: it is entered at its beginning only and left at its end.
 * Instructions that are skipped for their condition count. One processor, no interrupts.
 */
#include <inttypes.h>
#include <qemu-plugin.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MARKS_MAX 16

QEMU_PLUGIN_EXPORT int qemu_plugin_version = QEMU_PLUGIN_VERSION;

struct piece {
    uint64_t address;
    size_t instructions;
    uint64_t runs; /* in this phase; QEMU adds */
    struct piece *next;
};

static struct piece *pieces;
static uint64_t mark[MARKS_MAX];
static int mark_count;
static uint64_t stack_bottom, first_store, lowest_store = UINT64_MAX;
static uint64_t phase; /* its mark; 0: none yet */
static FILE *out;

static void end_phase(void)
{
    if (phase != 0) {
        fprintf(out, "phase %" PRIx64 " %" PRIx64 " %" PRIx64 "\n", phase, first_store,
                lowest_store);
    }
    for (struct piece *piece = pieces; piece != NULL; piece = piece->next) {
        if (phase != 0 && piece->runs != 0) {
            fprintf(out, "%" PRIx64 " %zx %" PRIx64 "\n", piece->address, piece->instructions,
                    piece->runs);
        }
        piece->runs = 0;
    }
    first_store = 0;
    lowest_store = UINT64_MAX;
}

/* A piece at a mark counts here, so that it belongs to the phase that it begins. */
static void on_mark(unsigned processor, void *data)
{
    struct piece *piece = data;
    (void)processor;
    end_phase();
    phase = piece->address;
    piece->runs = 1;
}

static void on_store(unsigned processor, qemu_plugin_meminfo_t info, uint64_t address, void *data)
{
    (void)processor;
    (void)info;
    (void)data;
    if (address < stack_bottom) {
        return;
    }
    if (first_store == 0) {
        first_store = address;
    }
    if (address < lowest_store) {
        lowest_store = address;
    }
}

static bool is_mark(uint64_t address)
{
    for (int i = 0; i < mark_count; i++) {
        if (mark[i] == address) {
            return true;
        }
    }
    return false;
}

static void on_translation(qemu_plugin_id_t id, struct qemu_plugin_tb *tb)
{
    (void)id;
    struct piece *piece = calloc(1, sizeof *piece);
    if (piece == NULL) {
        fputs("count: no memory\n", stderr);
        exit(1);
    }
    piece->address = qemu_plugin_tb_vaddr(tb);
    piece->instructions = qemu_plugin_tb_n_insns(tb);
    piece->next = pieces;
    pieces = piece;
    if (is_mark(piece->address)) {
        qemu_plugin_register_vcpu_tb_exec_cb(tb, on_mark, QEMU_PLUGIN_CB_NO_REGS, piece);
    } else {
        qemu_plugin_register_vcpu_tb_exec_inline(tb, QEMU_PLUGIN_INLINE_ADD_U64, &piece->runs, 1);
    }
    for (size_t i = 0; i < piece->instructions; i++) {
        qemu_plugin_register_vcpu_mem_cb(qemu_plugin_tb_get_insn(tb, i), on_store,
                                         QEMU_PLUGIN_CB_NO_REGS, QEMU_PLUGIN_MEM_W, NULL);
    }
}

static void on_exit(qemu_plugin_id_t id, void *data)
{
    (void)id;
    (void)data;
    end_phase();
    if (fclose(out) != 0) {
        perror("count");
    }
}

static bool take(const char *argument)
{
    if (strncmp(argument, "out=", 4) == 0 && out == NULL) {
        out = fopen(argument + 4, "w");
        return out != NULL;
    }
    if (strncmp(argument, "stack=", 6) == 0) {
        stack_bottom = strtoull(argument + 6, NULL, 16);
        return true;
    }
    if (strncmp(argument, "mark=", 5) == 0 && mark_count < MARKS_MAX) {
        mark[mark_count++] = strtoull(argument + 5, NULL, 16);
        return true;
    }
    return false;
}

QEMU_PLUGIN_EXPORT int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info,
                                           int argument_count, char **arguments)
{
    (void)info;
    for (int i = 0; i < argument_count; i++) {
        if (!take(arguments[i])) {
            fprintf(stderr, "count: %s: unknown, once too often, or cannot be written\n",
                    arguments[i]);
            return -1;
        }
    }
    if (out == NULL || stack_bottom == 0 || mark_count == 0) {
        fputs("count: expected out=FILE,stack=ADDRESS,mark=ADDRESS\n", stderr);
        return -1;
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
    qemu_plugin_register_atexit_cb(id, on_exit, NULL);
    return 0;
}
