/* Starts main after a reset of QEMU's mps2-an386. With newlib's semihosting, arguments, files and the exit code are the host's. */
#include <stdint.h>
#include <stdlib.h>

extern uint32_t stack_top;
extern void initialise_monitor_handles(void);
extern void __libc_init_array(void);
int main(int argc, char **argv);
void reset(void);
/* The functions that newlib calls before and after a program besides its tables. They do nothing here. */
void _init(void);
void _fini(void);

void _init(void) {}
void _fini(void) {}

static char line[512];
static char *arguments[16];

/* Reads the command line with the semihosting call SYS_GET_CMDLINE, and splits it at its spaces. */
static int read_arguments(void)
{
    struct {
        char *text;
        uint32_t size;
    } block = {line, sizeof line};
    register uint32_t call __asm__("r0") = 0x15;
    register void *parameter __asm__("r1") = &block;
    __asm__ volatile("bkpt 0xab" : "+r"(call) : "r"(parameter) : "memory");
    int count = 0;
    char *at = line;
    while (count < 15) {
        while (*at == ' ')
            *at++ = 0;
        if (*at == 0)
            break;
        arguments[count++] = at;
        while (*at != 0 && *at != ' ')
            at++;
    }
    return count;
}

void reset(void)
{
#ifdef __ARM_FP
    /* Enables the floating-point unit before any code uses it. Without one, such an instruction is a fault. */
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20;
    __asm__ volatile("dsb\n isb");
#endif
    initialise_monitor_handles();
    __libc_init_array();
    exit(main(read_arguments(), arguments));
}

/* A fault ends the program with an error. */
static void fault(void)
{
    _Exit(1);
}

__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    void (*handlers[15])(void);
} vectors = {&stack_top, {reset, fault, fault, fault, fault, fault}};
