/*
 * Prints the events of a source, the ends of their contacts and slips as JSON, with every field of the header.
 *
 *     records SOURCE [CONFIG.toml]
 */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <wstac.h>

static void number(const char *name, double value)
{
    isnan(value) ? printf(", \"%s\": null", name) : printf(", \"%s\": %.17g", name, value);
}

static void whole(const char *name, int64_t value)
{
    printf(", \"%s\": %" PRId64, name, value);
}

static void truth(const char *name, bool value)
{
    printf(", \"%s\": %s", name, value ? "true" : "false");
}

/* Texts of this library have no characters that JSON escapes. */
static void text(const char *name, const char *value)
{
    value == NULL ? printf(", \"%s\": null", name) : printf(", \"%s\": \"%s\"", name, value);
}

static void print_event(const WstacEvent *event, const WstacTexture *texture)
{
    number("speed_mm_s", event->speed_mm_s);
    truth("speed_extrapolated", event->speed_extrapolated);
    number("speed_at_most_mm_s", event->speed_at_most_mm_s);
    whole("duration_frames", event->duration_frames);
    number("direction_deg", event->direction_deg);
    number("direction_confidence", event->direction_confidence);
    whole("frames_filled", event->frames_filled);
    truth("reliable", event->reliable);
    text("why_no_speed", event->why_no_speed);
    text("why_no_direction", event->why_no_direction);
    text("why_not_reliable", event->why_not_reliable);
    text("why_texture", event->why_texture);
    text("contact", event->contact);
    number("speed_sd_mm_s", event->speed_sd_mm_s);
    number("direction_sd_deg", event->direction_sd_deg);
    whole("touch_frame", event->touch_frame);
    whole("end_frame", event->end_frame);
    number("touch_s", event->touch_s);
    number("completed_s", event->completed_s);
    whole("completed_ns", event->completed_ns);
    text("stamp", event->stamp);
    text("basis", event->basis);
    number("place_mm", event->place_mm);
    number("place_sd_mm", event->place_sd_mm);
    number("width_mm", event->width_mm);
    number("width_sd_mm", event->width_sd_mm);
    whole("contacts", event->contacts);
    number("acceleration_mm_s2", event->acceleration_mm_s2);
    number("acceleration_sd_mm_s2", event->acceleration_sd_mm_s2);
    number("period_mm", event->period_mm);
    number("period_sd_mm", event->period_sd_mm);
    text("specimen", texture->specimen);
    text("pattern", texture->pattern);
    number("depth_mm", texture->depth_mm);
    number("confidence", texture->confidence);
    whole("known", texture->known);
    text("other", texture->other);
    printf(", \"sample\": [");
    for (int frame = 0; frame < WSTAC_SAMPLE_FRAMES; frame++)
        for (int feature = 0; feature < WSTAC_FEATURES; feature++)
            printf("%s%d", frame + feature == 0 ? "" : ", ", event->sample[frame][feature]);
    printf("]");
}

int main(int argc, char **argv)
{
    const char *models[] = {"builtin:svm", NULL};
    WstacOptions options = {.models = models, .config = argc == 3 ? argv[2] : NULL};
    Wstac *sensor;
    WstacRecord record = {0};
    WstacStatus status = wstac_open(argc >= 2 ? argv[1] : "", &options, &sensor);
    while (status == WSTAC_STATUS_OK && record.kind != WSTAC_KIND_END) {
        status = wstac_next(sensor, &record);
        bool is_event = record.kind == WSTAC_KIND_EVENT, is_slip = record.kind == WSTAC_KIND_SLIP;
        if (status != WSTAC_STATUS_OK || (!is_event && !is_slip && record.kind != WSTAC_KIND_CONTACT_END))
            continue;
        printf("{\"kind\": \"%s\"", is_event ? "event" : is_slip ? "slip" : "contact_end");
        whole("frame", (int64_t)record.frame);
        whole("time_ns", record.time_ns);
        if (is_event) {
            print_event(&record.event, &record.texture);
        } else if (is_slip) {
            whole("onset_frame", (int64_t)record.onset_frame);
            whole("held_since_frame", (int64_t)record.held_since_frame);
            number("strength", record.strength);
        } else {
            whole("event_frame", (int64_t)record.event_frame);
            number("time_s", record.time_s);
        }
        printf("}\n");
    }
    if (status != WSTAC_STATUS_OK)
        fprintf(stderr, "%s: %s\n", wstac_error_text(status), wstac_error_message(sensor));
    wstac_close(sensor);
    return status != WSTAC_STATUS_OK;
}
