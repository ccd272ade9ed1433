// Stops a machine when a part that is held begins to slip, with a callback: ./slip_stop_cpp SOURCE
#include <cstdio>
#include <wstac.hpp>

// Put the call that stops your machine here.
static void stop() { std::puts("  stop"); }

int main(int argc, char **argv)
{
    if (argc != 2) {
        std::fputs("slip_stop: wrong arguments, expected SOURCE\n", stderr);
        return 2;
    }
    wstac::Sensor sensor = wstac::Sensor::open(argv[1]);
    const bool is_read = sensor && sensor.each([](const WstacRecord &record) noexcept {
        if (record.kind == WSTAC_KIND_SLIP) {
            const double frame = double(record.frame), onset = double(record.onset_frame);
            std::printf("frame %.0f: slip since frame %.0f, %.0f frames ago\n", frame, onset, frame - onset);
            stop();
        }
        return true;
    });
    if (!is_read)
        std::fprintf(stderr, "%s: %s\n", wstac_error_text(sensor.status()), sensor.error());
    return is_read ? 0 : 1;
}
