/* Stops a machine when a part that is held begins to slip: ./slip_stop SOURCE */
#include <stdio.h>
#include <wstac.h>

/* Put the call that stops your machine here. */
static void stop(void)
{
    puts("  stop");
}

int main(int argc, char **argv)
{
    Wstac *sensor;
    WstacRecord record = {0};
    if (argc != 2) {
        fputs("slip_stop: wrong arguments, expected SOURCE\n", stderr);
        return 2;
    }
    WstacStatus status = wstac_open(argv[1], NULL, &sensor);
    while (status == WSTAC_STATUS_OK && record.kind != WSTAC_KIND_END) {
        if ((status = wstac_next(sensor, &record)) != WSTAC_STATUS_OK)
            break;
        /* A part was pressed on and held, and moves now. */
        if (record.kind == WSTAC_KIND_SLIP) {
            double frame = (double)record.frame, onset = (double)record.onset_frame;
            printf("frame %.0f: slip since frame %.0f, %.0f frames ago\n", frame, onset, frame - onset);
            stop();
        }
        if (record.kind == WSTAC_KIND_FAULT)
            fprintf(stderr, "frame %.0f: %s\n", (double)record.frame, record.message);
    }
    if (status != WSTAC_STATUS_OK)
        fprintf(stderr, "%s: %s\n", wstac_error_text(status), wstac_error_message(sensor));
    wstac_close(sensor);
    return status != WSTAC_STATUS_OK;
}
