/* worst_count - a plugin for QEMU: instructions between two addresses of a program, each time.
 *
 *     -plugin libworst_count.so,out=FILE,from=ADDRESS,to=ADDRESS
 *
 * FILE gets a line with the number (decimal) each time that `to` is reached after `from`. Whole pieces of
 * code count: translation blocks, entered at their beginning only. Unlike tools/size/count.c it tells no
 * piece from another and looks at no stores, for the sake of ten thousand frames.
 */
#include <inttypes.h>
#include <qemu-plugin.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

QEMU_PLUGIN_EXPORT int qemu_plugin_version = QEMU_PLUGIN_VERSION;

static uint64_t from, to;
static uint64_t total; /* QEMU adds */
static uint64_t begun;
static FILE *out;

static void on_from(unsigned processor, void *data)
{
    (void)processor;
    (void)data;
    begun = total;
}

static void on_to(unsigned processor, void *data)
{
    (void)processor;
    (void)data;
    fprintf(out, "%" PRIu64 "\n", total - begun);
}

static void on_translation(qemu_plugin_id_t id, struct qemu_plugin_tb *tb)
{
    (void)id;
    uint64_t address = qemu_plugin_tb_vaddr(tb);
    if (address == from) {
        qemu_plugin_register_vcpu_tb_exec_cb(tb, on_from, QEMU_PLUGIN_CB_NO_REGS, NULL);
    } else if (address == to) {
        qemu_plugin_register_vcpu_tb_exec_cb(tb, on_to, QEMU_PLUGIN_CB_NO_REGS, NULL);
    }
    qemu_plugin_register_vcpu_tb_exec_inline(tb, QEMU_PLUGIN_INLINE_ADD_U64, &total,
                                             qemu_plugin_tb_n_insns(tb));
}

static void on_exit(qemu_plugin_id_t id, void *data)
{
    (void)id;
    (void)data;
    if (fclose(out) != 0) {
        perror("worst_count");
    }
}

QEMU_PLUGIN_EXPORT int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info,
                                           int argument_count, char **arguments)
{
    (void)info;
    for (int i = 0; i < argument_count; i++) {
        if (strncmp(arguments[i], "out=", 4) == 0) {
            out = fopen(arguments[i] + 4, "w");
        } else if (strncmp(arguments[i], "from=", 5) == 0) {
            from = strtoull(arguments[i] + 5, NULL, 16);
        } else if (strncmp(arguments[i], "to=", 3) == 0) {
            to = strtoull(arguments[i] + 3, NULL, 16);
        }
    }
    if (argument_count != 3 || out == NULL || from == 0 || to == 0) {
        fputs("worst_count: expected out=FILE,from=ADDRESS,to=ADDRESS, and a FILE to write\n",
              stderr);
        return -1;
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
    qemu_plugin_register_atexit_cb(id, on_exit, NULL);
    return 0;
}
