/* Stops a machine when something slips over the sensor faster than a limit: ./slip_stop SOURCE MM_S */
#include <stdio.h>
#include <stdlib.h>
#include <wstac.h>

/* Put the call that stops your machine here. */
static void stop(void)
{
    puts("  stop");
}

/* Put the call that starts it again here. */
static void start(void)
{
    puts("  start");
}

int main(int argc, char **argv)
{
    WstacOptions options = {.motion = 1};
    Wstac *sensor;
    WstacRecord record = {0};
    char *end = NULL;
    double limit = argc == 3 ? strtod(argv[2], &end) : 0;
    if (end == NULL || end == argv[2] || *end != 0) {
        fputs("slip_stop: wrong arguments, expected SOURCE MM_S\n", stderr);
        return 2;
    }
    int stopped = 0;
    WstacStatus status = wstac_open(argv[1], &options, &sensor);
    while (status == WSTAC_STATUS_OK && record.kind != WSTAC_KIND_END) {
        if ((status = wstac_next(sensor, &record)) != WSTAC_STATUS_OK)
            break;
        const WstacEvent *slip = &record.event;
        /* This comes with every frame while something slides. Two standard deviations make the decision safe. */
        if (record.kind == WSTAC_KIND_MOTION && !stopped && slip->speed_mm_s - 2 * slip->speed_sd_mm_s > limit) {
            printf("frame %.0f: slip at %.0f mm/s towards %.1f°\n", (double)record.frame, slip->speed_mm_s,
                   slip->direction_deg);
            stop();
            stopped = 1;
        }
        /* The light has left: nothing touches the sensor any more. */
        if (record.kind == WSTAC_KIND_CONTACT_END && stopped) {
            printf("frame %.0f: released\n", (double)record.frame);
            start();
            stopped = 0;
        }
        if (record.kind == WSTAC_KIND_FAULT)
            fprintf(stderr, "frame %.0f: %s\n", (double)record.frame, record.message);
    }
    if (status != WSTAC_STATUS_OK)
        fprintf(stderr, "%s: %s\n", wstac_error_text(status), wstac_error_message(sensor));
    wstac_close(sensor);
    return status != WSTAC_STATUS_OK;
}
