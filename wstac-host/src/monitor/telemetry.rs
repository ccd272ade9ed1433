//! The state of a board in words.

use wstac_core::wire::Telemetry;

use super::clock::ClockMatch;
use crate::plural::counted;

/// Returns the state of a board in words, as far as the board knows it, and the match of its clock.
pub fn in_words(telemetry: &Telemetry, clock: Option<ClockMatch>) -> String {
    let mut words = vec![format!("up for {}", duration(telemetry.uptime_ms))];
    words.extend(telemetry.millihertz.map(|millihertz| match millihertz {
        0 => "no frames".to_owned(),
        _ => format!("{:.2} frames per second", f64::from(millihertz) / 1000.0),
    }));
    words.extend(telemetry.overruns.map(|overruns| counted(overruns, "overrun")));
    words.extend(telemetry.restarts.map(|restarts| counted(restarts, "restart")));
    words.extend(telemetry.stack.map(|stack| format!("{stack} bytes of stack used")));
    words.extend(telemetry.temperature.map(|tenths| format!("{:.1} °C", f64::from(tenths) / 10.0)));
    words.push(counted(telemetry.events, "event"));
    if telemetry.kept > 0 {
        words.push(format!("{} not acknowledged", telemetry.kept));
    }
    if let Some(ClockMatch { within_ms, offset_s, fast_ppm }) = clock {
        let (seconds, side) = (offset_s.abs(), if offset_s < 0.0 { "ahead of" } else { "behind" });
        words.push(format!("clock {seconds:.4} s {side} this machine's within {within_ms:.1} ms"));
        words.extend(fast_ppm.map(|ppm| format!("{:.0} ppm {}", ppm.abs(), if ppm < 0.0 { "slow" } else { "fast" })));
    }
    words.join(", ")
}

/// Returns milliseconds in units that people use.
pub fn duration(ms: u64) -> String {
    let (seconds, minutes) = (ms / 1000, ms / 60_000);
    match (minutes / 60, minutes % 60, seconds % 60) {
        (0, 0, seconds) => format!("{seconds} s"),
        (0, minutes, seconds) => format!("{minutes} min {seconds} s"),
        (hours, minutes, _) => format!("{hours} h {minutes} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_known_is_left_out() {
        let mut telemetry = Telemetry::default();
        assert_eq!(in_words(&telemetry, None), "up for 0 s, 0 events");
        telemetry.uptime_ms = 3_723_004;
        telemetry.millihertz = Some(29_970);
        (telemetry.overruns, telemetry.restarts) = (Some(1), Some(0));
        (telemetry.stack, telemetry.temperature) = (Some(3120), Some(-5));
        (telemetry.events, telemetry.kept) = (1, 1);
        let expected = "up for 1 h 2 min, 29.97 frames per second, 1 overrun, 0 restarts, 3120 bytes of stack used, \
                        -0.5 °C, 1 event, 1 not acknowledged";
        assert_eq!(in_words(&telemetry, None), expected);
        let clock = |fast_ppm| Some(ClockMatch { within_ms: 0.34, offset_s: 5.125, fast_ppm });
        assert_eq!(
            in_words(&telemetry, clock(None)),
            format!("{expected}, clock 5.1250 s behind this machine's within 0.3 ms")
        );
        let expected = format!("{expected}, clock 5.1250 s behind this machine's within 0.3 ms, 12 ppm slow");
        assert_eq!(in_words(&telemetry, clock(Some(-12.4))), expected);
        telemetry.millihertz = Some(0);
        assert!(in_words(&telemetry, None).starts_with("up for 1 h 2 min, no frames, 1 overrun"));
        assert_eq!([59_999, 60_000, 3_599_999].map(duration), ["59 s", "1 min 0 s", "59 min 59 s"]);
    }
}
