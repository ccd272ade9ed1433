#include "wstac_esp32.h"

/* A longer gap counts as one of an hour. Either ends the touch. */
#define LONGEST_GAP_US 3600000000
#define LARGEST 1000000u

WstacFwStatus wstac_esp32_init(WstacEsp32 *sensor, const WstacFwOptions *options, WstacEsp32Report *report)
{
    if (sensor == NULL || options == NULL || report == NULL)
        return WSTAC_FW_STATUS_NULL;
    if (options->fps_numerator == 0 || options->fps_numerator > LARGEST)
        return WSTAC_FW_STATUS_FRAME_RATE;
    if (options->fps_denominator == 0 || options->fps_denominator > LARGEST)
        return WSTAC_FW_STATUS_FRAME_RATE;
    sensor->options = *options;
    sensor->report = report;
    sensor->used = sensor->lost = sensor->surplus = 0;
    sensor->has_time = sensor->is_back = false;
    sensor->time_us = sensor->behind = 0;
    return wstac_fw_init(&sensor->pipeline, sizeof sensor->pipeline, options);
}

/*
 * Returns the periods from the last frame to this one. Jitter of less than half a period does not count. What it adds
 * up to, when the camera's rate is not that of the options, is taken back a period at a time.
 */
static int64_t periods(WstacEsp32 *sensor, int64_t time_us)
{
    int64_t period = 1000000 * (int64_t)sensor->options.fps_denominator;
    uint64_t gap = (uint64_t)time_us - (uint64_t)sensor->time_us;
    int64_t passed = (int64_t)(gap > LONGEST_GAP_US ? LONGEST_GAP_US : gap) * sensor->options.fps_numerator;
    int64_t count = (passed + period / 2) / period;
    if (count == 0)
        count = 1;
    sensor->behind += passed - count * period;
    if (sensor->behind >= period) {
        count++;
        sensor->behind -= period;
    } else if (sensor->behind <= -period) {
        count--;
        sensor->behind += period;
    }
    return count;
}

WstacFwStatus wstac_esp32_take(WstacEsp32 *sensor, const uint8_t *bytes, size_t length, int64_t time_us)
{
    int64_t count;
    WstacFwStatus status;
    if (sensor == NULL || bytes == NULL)
        return WSTAC_FW_STATUS_NULL;
    if (!sensor->has_time || time_us > sensor->time_us) {
        count = sensor->has_time ? periods(sensor, time_us) : 1;
    } else if (!sensor->is_back) {
        /* One wrong time: the next frame shows that this one is missing. */
        sensor->is_back = true;
        return WSTAC_FW_STATUS_OTHER;
    } else {
        /* The clock was set back. Only the frame that was refused for it is missing. */
        count = 2;
        sensor->behind = 0;
    }
    sensor->is_back = false;
    sensor->time_us = time_us;
    sensor->has_time = true;
    if (count == 0) {
        sensor->surplus++;
        return WSTAC_FW_STATUS_NONE;
    }
    if (count > 1) {
        sensor->lost += (uint32_t)(count - 1);
        sensor->report(&sensor->pipeline, wstac_fw_push_lost(&sensor->pipeline, (uint64_t)(count - 1)));
    }
    status = wstac_fw_push_frame(&sensor->pipeline, bytes, length);
    if (status < 0) {
        sensor->lost++;
        sensor->report(&sensor->pipeline, wstac_fw_push_lost(&sensor->pipeline, 1));
        return status;
    }
    sensor->used++;
    sensor->report(&sensor->pipeline, status);
    return WSTAC_FW_STATUS_OK;
}
