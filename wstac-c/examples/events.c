/* Prints the events of a source: cc events.c -o events $(pkg-config --cflags --libs wstac) && ./events FILE.mcap */
#include <math.h>
#include <stdio.h>
#include <wstac.h>

static void print(const char *name, int decimals, double number, double sd)
{
    isnan(number) ? printf("%s=-", name) : printf("%s=%.*f", name, decimals, number);
    isnan(number) || isnan(sd) ? printf(" ") : printf("±%.2f ", sd < 0.01 ? 0.01 : sd);
}

int main(int argc, char **argv)
{
    WstacOptions options = {.models = (const char *[]){"builtin", NULL}};
    Wstac *sensor;
    WstacRecord record = {0};
    WstacStatus status = wstac_open(argc == 2 ? argv[1] : "", &options, &sensor);
    fprintf(stderr, "%s%s", wstac_notes(sensor), *wstac_notes(sensor) ? "\n" : "");
    while (status == WSTAC_STATUS_OK && record.kind != WSTAC_KIND_END)
        if ((status = wstac_next(sensor, &record)) == WSTAC_STATUS_OK && record.kind == WSTAC_KIND_EVENT) {
            printf("frame=%.0f ", (double)record.frame);
            print("speed", 2, record.event.reliable ? record.event.speed_mm_s : NAN, record.event.speed_sd_mm_s);
            print("direction", 1, record.event.reliable ? record.event.direction_deg : NAN, record.event.direction_sd_deg);
            printf("texture=%s\n", record.texture.specimen ? record.texture.specimen : "-");
        }
    if (status != WSTAC_STATUS_OK)
        fprintf(stderr, "%s: %s\n", wstac_error_text(status), wstac_error_message(sensor));
    wstac_close(sensor);
    return status != WSTAC_STATUS_OK;
}
