// A loop that answers each frame before a deadline, and counts those that it could not: ./bounded_loop FRAMES [PASSES]
// FRAMES has raw frames: wstac run scene:Saw3@150,90deg --size 640x480 --save-raw FRAMES
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <thread>
#include <vector>
#include <wstac.hpp>

typedef std::chrono::steady_clock Clock;
static const std::uint32_t WIDTH = 640, HEIGHT = 480, RATE = 30;
static const double DEADLINE_MS = 10;

int main(int argc, char **argv)
{
    if (argc != 2 && argc != 3) {
        std::fputs("bounded_loop: wrong arguments, expected FRAMES [PASSES]\n", stderr);
        return 2;
    }
    const int passes = argc == 3 ? std::atoi(argv[2]) : 1;
    if (passes < 1) {
        std::fprintf(stderr, "bounded_loop: PASSES is %s, expected 1 or more\n", argv[2]);
        return 2;
    }
    std::ifstream file(argv[1], std::ios::binary);
    const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    const std::size_t size = std::size_t(WIDTH) * HEIGHT, count = bytes.size() / size;
    const std::size_t end = count * std::size_t(passes);
    WstacFrames frames = WstacFrames();
    frames.width = WIDTH, frames.height = HEIGHT, frames.format = "GREY", frames.fps_numerator = RATE;
    frames.fps_denominator = 1;
    WstacOptions options = WstacOptions();
    options.features = options.motion = options.at_once = true;
    wstac::Sensor sensor = wstac::Sensor::of_frames(frames, options);
    // What is reserved now is not waited for in the loop.
    std::vector<double> took;
    took.reserve(end);
    std::size_t events = 0, lost = 0, late = 0;
    const Clock::time_point start = Clock::now();
    for (std::size_t number = 0; number < end && sensor; ++number) {
        // Put the wait for your camera here, and its time stamp: this one has a frame every 1/30 s.
        const auto stamp_of = [start](std::size_t at) { return start + std::chrono::nanoseconds(at * 1000000000 / RATE); };
        std::this_thread::sleep_until(stamp_of(number));
        // Who comes late takes the newest frame: those before it keep their place in time.
        std::size_t newest = number;
        while (newest + 1 < end && stamp_of(newest + 1) <= Clock::now())
            ++newest;
        if (newest > number && !sensor.lose(newest - number))
            break;
        lost += newest - number, number = newest;
        const auto *frame = reinterpret_cast<const std::uint8_t *>(bytes.data()) + number % count * size;
        if (!sensor.push(frame, size) || !sensor.each([&events](const WstacRecord &record) noexcept {
                // Put what your machine does about a slip, a motion or an event here.
                events += record.kind == WSTAC_KIND_EVENT;
                return true;
            }))
            break;
        took.push_back(std::chrono::duration<double, std::milli>(Clock::now() - stamp_of(number)).count());
        late += took.back() > DEADLINE_MS;
    }
    if (!sensor || took.empty()) {
        std::fprintf(stderr, "bounded_loop: %s\n", sensor ? "FRAMES has no frame of 640 x 480 GREY" : sensor.error());
        return 1;
    }
    std::sort(took.begin(), took.end());
    std::printf("frames: %zu, lost: %zu, late: %zu, events: %zu; ", took.size(), lost, late, events);
    std::printf("stamp to answer in ms: median %.3f, 99 %% %.3f, worst %.3f\n", took[took.size() / 2],
                took[took.size() * 99 / 100], took.back());
    return 0;
}
