/**
 * @file
 * WSTac for C++: the handle of wstac.h as a class that closes itself, from C++11 on.
 *
 * Nothing here throws or allocates, and nothing but each() blocks more than the function of wstac.h that it calls,
 * which describes it.
 */

#ifndef WSTAC_HPP
#define WSTAC_HPP

#include <cstddef>
#include <cstdint>
#include <utility>

#include "wstac.h"

namespace wstac {

/// A sensor. It belongs to the thread that opened it, and can be moved, but not copied.
class Sensor {
public:
    /// Opens a source (wstac_open). If that fails, the sensor is false and error() says why.
    static Sensor open(const char *source, const WstacOptions &options = WstacOptions()) noexcept
    {
        Sensor sensor;
        sensor.status_ = wstac_open(source, &options, &sensor.handle_);
        return sensor;
    }

    /// Opens a sensor whose frames the program pushes (wstac_open_frames).
    static Sensor of_frames(const WstacFrames &frames, const WstacOptions &options = WstacOptions()) noexcept
    {
        Sensor sensor;
        sensor.is_pushed_ = true;
        sensor.status_ = wstac_open_frames(&frames, &options, &sensor.handle_);
        return sensor;
    }

    Sensor(Sensor &&other) noexcept : handle_(other.handle_), status_(other.status_), is_pushed_(other.is_pushed_)
    {
        other.handle_ = nullptr;
        other.status_ = WSTAC_STATUS_NULL;
    }

    Sensor &operator=(Sensor &&other) noexcept
    {
        std::swap(handle_, other.handle_);
        std::swap(status_, other.status_);
        std::swap(is_pushed_, other.is_pushed_);
        return *this;
    }

    Sensor(const Sensor &) = delete;
    Sensor &operator=(const Sensor &) = delete;

    ~Sensor() { wstac_close(handle_); }

    /// Returns whether the last call succeeded.
    explicit operator bool() const noexcept { return status_ == WSTAC_STATUS_OK; }

    /// Returns the status of the last call.
    WstacStatus status() const noexcept { return status_; }

    /// Returns the message of the last call that failed, valid until the next call.
    const char *error() const noexcept { return wstac_error_message(handle_); }

    /// Writes the next record (wstac_next). Returns whether that succeeded.
    bool next(WstacRecord &record) noexcept { return done(wstac_next(handle_, &record)); }

    /// Takes a frame that the program has (wstac_push_frame).
    bool push(const std::uint8_t *bytes, std::size_t length) noexcept
    {
        return done(wstac_push_frame(handle_, bytes, length));
    }

    /// Keeps the place of lost frames in time (wstac_push_lost).
    bool lose(std::uint64_t frames) noexcept { return done(wstac_push_lost(handle_, frames)); }

    /// Ends the stream (wstac_finish). next() gives what is pending.
    bool finish() noexcept { return done(wstac_finish(handle_)); }

    /// Calls take(record) for each record. Of a source it does so until its end, with WSTAC_KIND_WAITING within a
    /// second if there is none; of pushed frames until more are needed. take returns false to stop earlier. It must
    /// not throw. Returns whether no call failed.
    template <typename Take>
    bool each(Take &&take) noexcept
    {
        WstacRecord record = WstacRecord();
        bool goes_on = true;
        while (goes_on && next(record)) {
            if (is_pushed_ && record.kind == WSTAC_KIND_WAITING)
                return true;
            goes_on = take(static_cast<const WstacRecord &>(record)) && record.kind != WSTAC_KIND_END;
        }
        return status_ == WSTAC_STATUS_OK;
    }

    /// Returns what nothing states of the source (wstac_notes), valid as long as the sensor.
    const char *notes() const noexcept { return wstac_notes(handle_); }

    /// Returns the handle, for what wstac.h has and this class has not. The sensor still closes it.
    Wstac *get() const noexcept { return handle_; }

private:
    Sensor() noexcept : handle_(nullptr), status_(WSTAC_STATUS_NULL), is_pushed_(false) {}

    bool done(WstacStatus status) noexcept
    {
        status_ = status;
        return status == WSTAC_STATUS_OK;
    }

    Wstac *handle_;
    WstacStatus status_;
    bool is_pushed_;
};

}  // namespace wstac

#endif  /* WSTAC_HPP */
