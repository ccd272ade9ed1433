/* Times `int classify(const int16_t *)` of shared libraries on this machine, one sample per call.
   host ROUNDS (LIBRARY SAMPLES)...: in each round every library answers all its samples; prints each one's nanoseconds an answer in
   its fastest round, as the others were disturbed by something. */
#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { INPUTS = 700, MOST = 32 };
typedef int (*classify)(const int16_t *);

int main(int count, char **words) {
    int rounds = atoi(words[1]), libraries = (count - 2) / 2;
    classify answer[MOST];
    int16_t *samples[MOST];
    long n[MOST];
    double fastest[MOST];
    volatile int sink;
    for (int i = 0; i < libraries && i < MOST; i++) {
        void *library = dlopen(words[2 + 2 * i], RTLD_NOW | RTLD_LOCAL);
        FILE *file = fopen(words[3 + 2 * i], "rb");
        if (!library || !file) return fprintf(stderr, "host: %s: %s\n", words[2 + 2 * i], dlerror()), 1;
        answer[i] = (classify)dlsym(library, "classify");
        fseek(file, 0, SEEK_END);
        n[i] = ftell(file) / (2 * INPUTS);
        rewind(file);
        samples[i] = malloc(n[i] * 2 * INPUTS);
        if (fread(samples[i], 2 * INPUTS, n[i], file) != (size_t)n[i]) return 1;
        fastest[i] = 1e300;
    }
    for (int round = 0; round < rounds; round++)
        for (int i = 0; i < libraries; i++) {
            struct timespec from, to;
            clock_gettime(CLOCK_MONOTONIC, &from);
            for (long k = 0; k < n[i]; k++) sink = answer[i](samples[i] + k * INPUTS);
            clock_gettime(CLOCK_MONOTONIC, &to);
            double ns = ((to.tv_sec - from.tv_sec) * 1e9 + (to.tv_nsec - from.tv_nsec)) / n[i];
            if (ns < fastest[i]) fastest[i] = ns;
        }
    (void)sink;
    for (int i = 0; i < libraries; i++) printf("%.1f\n", fastest[i]);
}
