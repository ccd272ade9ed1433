/* The logarithms and sums of others, for comparison. They take integers and return logarithms in units of 2^-26. */
#include <math.h>
#include <stdint.h>

#define UNIT 67108864.0f

void peer_logf(const uint32_t *numbers, int32_t *logs, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        logs[i] = (int32_t)(logf((float)numbers[i]) * UNIT + 0.5f);
}

#ifdef CMSIS_DSP
#include "arm_math.h"

uint32_t peer_vlog_f32(const uint32_t *numbers, int32_t *logs, uint32_t count)
{
    float32_t values[256];
    for (uint32_t i = 0; i < count; i++)
        values[i] = (float32_t)numbers[i];
    arm_vlog_f32(values, values, count);
    for (uint32_t i = 0; i < count; i++)
        logs[i] = (int32_t)(values[i] * UNIT + 0.5f);
    return 1;
}

/* Returns logarithms of n / 2^31, in units of 2^-26. Integers below 2^31 already have this format. */
uint32_t peer_vlog_q31(const uint32_t *numbers, int32_t *logs, uint32_t count)
{
    arm_vlog_q31((const q31_t *)numbers, (q31_t *)logs, count);
    for (uint32_t i = 0; i < count; i++)
        logs[i] += 1442005916; /* 31 ln 2 */
    return 1;
}
#else
uint32_t peer_vlog_f32(const uint32_t *numbers, int32_t *logs, uint32_t count) { return 0; }
uint32_t peer_vlog_q31(const uint32_t *numbers, int32_t *logs, uint32_t count) { return 0; }
#endif

void peer_sums(const uint8_t *stripe, uint32_t first, uint32_t rows, uint32_t width, const uint16_t (*corners)[2], const uint16_t *taxel, uint32_t *sums)
{
    for (uint32_t y = first; y < first + rows; y++, stripe += width)
        for (uint32_t k = 0; k < 25; k++) {
            const uint32_t x = corners[k][0], top = corners[k][1];
            if (y < top || y >= top + taxel[1])
                continue;
            uint32_t sum = sums[k];
            for (uint32_t i = 0; i < taxel[0]; i++)
                sum += stripe[x + i];
            sums[k] = sum;
        }
}
