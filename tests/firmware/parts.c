/* A plugin of QEMU that counts the instructions of a program's parts (parts.py).
 *
 * The file `table` has two bytes for each two bytes of code: the part, 0 for that of the caller; and the bytes of a call in
 * the lower four bits, of a function that is counted its number in the upper ones. The file `counts` gets 32 numbers for each
 * call of such a function: the instructions of each part, and the function's number.
 */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* QEMU's interface, of which Debian has no header. QEMU 9 and newer expect 2. */
int qemu_plugin_version = 1;
void qemu_plugin_register_vcpu_tb_trans_cb(uint64_t, void (*)(uint64_t, void *));
size_t qemu_plugin_tb_n_insns(const void *);
void *qemu_plugin_tb_get_insn(const void *, size_t);
uint64_t qemu_plugin_insn_vaddr(const void *);
void qemu_plugin_register_vcpu_insn_exec_cb(void *, void (*)(unsigned, void *), int, void *);

#define PARTS 31
static uint8_t table[1 << 20];
static struct { uintptr_t back; unsigned part; } calls[256];
static unsigned counts[PARTS + 1], depth, outermost, function, part;
static uintptr_t behind_call;
static FILE *found;

static void step(unsigned core, void *data)
{
    uintptr_t at = (uintptr_t)data;
    if (behind_call && at != behind_call) {
        calls[depth].back = behind_call;
        calls[depth++].part = part;
        if (table[at + 1] >> 4 && !function) {
            function = table[at + 1] >> 4;
            outermost = depth;
            memset(counts, 0, sizeof counts);
        }
    } else if (depth && at == calls[depth - 1].back) {
        if (function && depth == outermost) {
            counts[PARTS] = function;
            fwrite(counts, sizeof counts, 1, found);
            function = 0;
        }
        part = calls[--depth].part;
    }
    part = table[at] ? table[at] : part;
    counts[part]++;
    behind_call = table[at + 1] & 15 ? at + (table[at + 1] & 15) : 0;
}

static void translated(uint64_t plugin, void *block)
{
    for (size_t i = 0; i < qemu_plugin_tb_n_insns(block); i++) {
        void *instruction = qemu_plugin_tb_get_insn(block, i);
        uintptr_t at = qemu_plugin_insn_vaddr(instruction);
        if (at + 1 < sizeof table)
            qemu_plugin_register_vcpu_insn_exec_cb(instruction, step, 0, (void *)at);
    }
}

int qemu_plugin_install(uint64_t plugin, const void *of, int count, char **arguments)
{
    FILE *file = fopen("table", "rb");
    found = fopen("counts", "w");
    if (!file || !found)
        return 1;
    fread(table, 1, sizeof table, file);
    fclose(file);
    qemu_plugin_register_vcpu_tb_trans_cb(plugin, translated);
    return 0;
}
